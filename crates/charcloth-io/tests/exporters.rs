//! Frames out: what is written is read back, seams are the only doubled points, dead triangles stay behind.

mod common;

use charcloth::frame::Frame;
use charcloth::registry::Entry;
use charcloth::scene::LengthUnit;
use charcloth_io::cache::{CacheReader, CacheWriter, RunInfo};
use charcloth_io::exporters::{EXPORTERS, ExportOptions, Exporter, Writer, display_color, export, write_frame};
use charcloth_io::importers::read_mesh;
use common::{Folder, sheet};
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{DefaultElement, Property};
use std::ops::ControlFlow;

/// Formats with a file a frame; those of all frames have readers of their own in `readers.rs`.
fn frame_formats() -> impl Iterator<Item = &'static Entry<Exporter>> {
    EXPORTERS.iter().filter(|row| matches!(row.item.write, Writer::EachFrame(_)))
}

#[test]
fn every_format_gives_back_the_living_surface() {
    let folder = Folder::new("formats");
    let frame = Frame::of(&sheet(9), 12, 0.5);
    for row in frame_formats() {
        let path = folder.0.join(format!("frame.{}", row.item.extension));
        write_frame(&frame, &path).unwrap();
        let mesh = read_mesh(&path, LengthUnit::M).unwrap();
        assert_eq!(mesh.triangles.len(), 127, "{}", row.name);
        // The last node has lost one of its two triangles and stays.
        assert_eq!(mesh.positions.len(), 81, "{}", row.name);
        for (i, position) in mesh.positions.iter().enumerate() {
            assert!(position.abs_diff_eq(frame.motion.position[i], 1e-7), "{} {i}", row.name);
        }
        for t in 0..127 {
            assert_eq!(mesh.triangles[t], frame.triangles.corners[t], "{} {t}", row.name);
            assert_eq!(mesh.corner_uv[t], frame.triangles.uv[t], "{} {t}", row.name);
        }
        assert!(mesh.remarks.is_empty(), "{:?}", mesh.remarks);
        // Nothing half written stays behind.
        assert_eq!(std::fs::read_dir(&folder.0).unwrap().count(), 1, "{}", row.name);
        std::fs::remove_file(path).unwrap();
    }
}

#[test]
fn ply_carries_every_column_and_doubles_points_at_the_seam_only() {
    let folder = Folder::new("columns");
    let state = sheet(9);
    let frame = Frame::of(&state, 12, 0.5);
    let path = folder.0.join("a.ply");
    write_frame(&frame, &path).unwrap();
    let mut file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
    let ply = Parser::<DefaultElement>::new().read_ply(&mut file).unwrap();
    let vertices = &ply.payload["vertex"];
    assert_eq!(vertices.len(), 81 + 9);
    let expected = "x y z nx ny nz s t vx vy vz inert_mass rest_x rest_y rest_z source sheet pinned alive temperature fuel_mass \
        fuel_initial heat peak_temperature ignited_at area id fuel burn char ash age origin_face \
        origin_a origin_b origin_c origin_weights_a red green blue";
    for name in expected.split_whitespace() {
        assert!(vertices[0].contains_key(name), "{name}");
    }
    let float = |v: &DefaultElement, name: &str| match v[name] {
        Property::Float(value) => f64::from(value),
        ref other => panic!("{name} is {other:?}"),
    };
    for vertex in vertices {
        let Property::UInt(id) = vertex["id"] else { panic!("id") };
        let i = id as usize;
        assert_eq!(float(vertex, "temperature"), f64::from(state.burn.temperature[i] as f32));
        assert!((float(vertex, "fuel") - state.burn.fuel[i] / 1e-6).abs() < 1e-6);
        assert_eq!(float(vertex, "fuel_mass"), f64::from(state.burn.fuel[i] as f32));
        assert!((float(vertex, "burn") - (1.0 - state.burn.fuel[i] / 1e-6)).abs() < 1e-6);
        let age = if state.burn.ignited_at[i] < 0.0 { -1.0 } else { 0.25 };
        assert_eq!(float(vertex, "age"), age);
    }
    assert_eq!(ply.payload["face"][6]["source_face"], Property::UInt(3));
    let comments = ply.header.comments.iter().map(|c| c.to_string()).collect::<Vec<_>>().join("\n");
    assert!(comments.contains("frame 12, time 0.5 s") && comments.contains("metres"), "{comments}");
}

#[test]
fn frames_with_nothing_left_and_frames_of_chains_are_written() {
    let folder = Folder::new("nothing");
    let mut frame = Frame::of(&sheet(3), 0, 0.0);
    frame.triangles.alive.fill(0);
    let chain = Frame { triangles: Default::default(), ..frame.clone() };
    for row in frame_formats() {
        let path = folder.0.join(format!("a.{}", row.item.extension));
        for frame in [&frame, &chain, &Frame::default()] {
            write_frame(frame, &path).unwrap();
            // A surface without faces cannot burn, and says so instead of failing in another way.
            let message = read_mesh(&path, LengthUnit::M).unwrap_err().to_string();
            assert!(message.contains("it has no"), "{message}");
        }
    }
}

#[test]
fn a_cache_is_exported_in_part_and_may_be_stopped() {
    let folder = Folder::new("export");
    let mut writer =
        CacheWriter::create(&folder.0, &RunInfo { scene: "test".into(), fps: 24.0, ..RunInfo::default() }).unwrap();
    let state = sheet(4);
    for number in 0..6 {
        writer.write(&Frame::of(&state, number, f64::from(number) / 24.0), &[], &state).unwrap();
    }
    let cache = CacheReader::open(&folder.0).unwrap();
    let out = folder.0.join("some/where");
    let some = |frames| ExportOptions { frames: Some(frames), ..ExportOptions::default() };
    let mut told = Vec::new();
    let mut progress = |now: charcloth_io::exporters::Progress<'_>| {
        told.push((now.done, now.total));
        if now.done == 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let written = export(&cache, "obj", &some(2..=9), &out, &mut progress).unwrap();
    assert_eq!(told, [(1, 4), (2, 4), (3, 4)]);
    assert_eq!(written.files.len(), 3);
    assert!(out.join("frame_00002.obj").is_file() && !out.join("frame_00005.obj").exists());

    let mut quiet = |_: charcloth_io::exporters::Progress<'_>| ControlFlow::Continue(());
    assert_eq!(export(&cache, "ply", &ExportOptions::default(), &out, &mut quiet).unwrap().files.len(), 6);
    let message = export(&cache, "ply", &some(7..=9), &out, &mut quiet).unwrap_err().to_string();
    assert!(message.contains("there are frames 0 to 5"), "{message}");
    let message = export(&cache, "plx", &ExportOptions::default(), &out, &mut quiet).unwrap_err().to_string();
    assert!(message.contains("did you mean ply?") && message.contains("ply, obj"), "{message}");
}

#[test]
fn a_shorter_export_leaves_nothing_of_the_longer_one_and_everything_else() {
    let folder = Folder::new("shorter");
    let mut writer = CacheWriter::create(&folder.0, &RunInfo { fps: 24.0, ..RunInfo::default() }).unwrap();
    let state = sheet(4);
    for number in 0..6 {
        writer.write(&Frame::of(&state, number, f64::from(number) / 24.0), &[], &state).unwrap();
    }
    let cache = CacheReader::open(&folder.0).unwrap();
    let out = Folder::new("shorter-out");
    let go = |format: &str, last: u32, force: bool| {
        let options = ExportOptions { frames: Some(0..=last), resolution: 16, force, ..ExportOptions::default() };
        export(&cache, format, &options, &out.0, &mut |_| ControlFlow::Continue(()))
    };
    let there = || {
        let mut names: Vec<String> = std::fs::read_dir(&out.0)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    };
    let mine = out.file("frame_00009.obj", "mine");
    assert_eq!(go("obj", 5, false).unwrap().removed, 0);
    assert_eq!(go("maps", 3, false).unwrap().removed, 0);
    assert_eq!(there().len(), 1 + 1 + 6 + (3 + 2 * 4));
    assert_eq!(go("obj", 2, false).unwrap().removed, 3);
    assert_eq!(go("maps", 1, false).unwrap().removed, 4);
    let left = there();
    assert_eq!(left.len(), 1 + 1 + 3 + (3 + 2 * 2), "{left:?}");
    assert!(left.contains(&"frame_00009.obj".to_string()) && std::fs::read_to_string(&mine).unwrap() == "mine");

    // A file that somebody has changed is theirs: it is neither replaced nor removed.
    let changed = out.file("frame_00001.obj", "changed by hand");
    let message = go("obj", 5, false).unwrap_err().to_string();
    assert!(message.contains("frame_00001.obj") && message.contains("changed") && message.contains("--force"));
    assert_eq!(there(), left);
    assert_eq!(go("obj", 0, false).unwrap().removed, 1);
    assert_eq!(std::fs::read_to_string(&changed).unwrap(), "changed by hand");
    // So is one that was there before, and one of another format.
    let message = go("obj", 5, false).unwrap_err().to_string();
    assert!(message.contains("no export wrote") && message.contains("frame_00001.obj"), "{message}");
    go("obj", 5, true).unwrap();
    assert_eq!(go("obj", 0, false).unwrap().removed, 5);
    go("gltf", 5, false).unwrap();
    let message = go("vat", 5, false).unwrap_err().to_string();
    assert!(message.contains("sheet.glb") && message.contains("gltf"), "{message}");

    // Point caches have the mesh that they move in common, if it is the same; with force the last one has it.
    let owners = || {
        let list: serde_json::Value =
            serde_json::from_slice(&std::fs::read(out.0.join("export.json")).unwrap()).unwrap();
        ["pc2", "mdd"].map(|format| list["exports"][format].get("sheet.obj").is_some())
    };
    let later = |format: &str, force: bool| {
        let options = ExportOptions { frames: Some(1..=5), force, ..ExportOptions::default() };
        export(&cache, format, &options, &out.0, &mut |_| ControlFlow::Continue(()))
    };
    for format in ["pc2", "mdd", "pc2"] {
        go(format, 5, false).unwrap();
    }
    assert_eq!(owners(), [true, true]);
    let caches = || ["sheet.pc2", "sheet.mdd", "sheet.obj"].map(|name| std::fs::read(out.0.join(name)).unwrap());
    let before = caches();
    let message = later("mdd", false).unwrap_err().to_string();
    assert!(message.contains("sheet.obj") && message.contains("another format"), "{message}");
    assert!(caches() == before && owners() == [true, true]);
    later("mdd", true).unwrap();
    assert_eq!(owners(), [false, true]);
    assert!(go("pc2", 5, false).unwrap_err().to_string().contains("sheet.obj"));
    later("pc2", false).unwrap();
    assert_eq!(owners(), [true, true]);
    out.file("sheet.obj", "changed by hand");
    assert!(later("pc2", false).unwrap_err().to_string().contains("changed"));

    // A list that was tampered with reaches no file outside of the folder.
    let outside = folder.file("outside.obj", "mine");
    let reach = format!("../{}/outside.obj", folder.0.file_name().unwrap().to_string_lossy());
    let list = std::fs::read_to_string(out.0.join("export.json")).unwrap();
    std::fs::write(
        out.0.join("export.json"),
        list.replace("\"frame_00000.obj\": ", &format!("\"{reach}\": 4, \"a\": ")),
    )
    .unwrap();
    std::fs::remove_file(out.0.join("frame_00000.obj")).unwrap();
    assert_eq!(go("obj", 0, false).unwrap().removed, 0);
    assert_eq!(std::fs::read_to_string(outside).unwrap(), "mine");
    std::fs::write(out.0.join("export.json"), "{").unwrap();
    assert!(go("obj", 0, false).unwrap_err().to_string().contains("export.json"));
}

#[test]
fn what_an_export_that_failed_wrote_is_replaced_by_the_next() {
    let folder = Folder::new("failed");
    let mut writer = CacheWriter::create(&folder.0, &RunInfo { fps: 24.0, ..RunInfo::default() }).unwrap();
    let state = sheet(4);
    for number in 0..4 {
        writer.write(&Frame::of(&state, number, f64::from(number) / 24.0), &[], &state).unwrap();
    }
    let cache = CacheReader::open(&folder.0).unwrap();
    let frame = folder.0.join("cache/frame_00002.npz");
    let bytes = std::fs::read(&frame).unwrap();
    let go = |out: &Folder| {
        let options = ExportOptions { resolution: 16, ..ExportOptions::default() };
        export(&cache, "ply", &options, &out.0, &mut |_| ControlFlow::Continue(()))
    };
    let out = Folder::new("failed-out");
    std::fs::write(&frame, "cut").unwrap();
    go(&out).unwrap_err();
    assert!(out.0.join("frame_00001.ply").is_file() && !out.0.join("frame_00002.ply").exists());
    std::fs::write(&frame, bytes).unwrap();
    assert_eq!(go(&out).unwrap().files.len(), 4);
}

#[test]
fn a_folder_that_cannot_be_written_is_named() {
    let folder = Folder::new("unwritable");
    let path = folder.0.join("missing/a.ply");
    let message = write_frame(&Frame::default(), &path).unwrap_err().to_string();
    assert!(message.starts_with("cannot write") && message.contains("a.ply"), "{message}");
}

#[test]
fn paper_goes_from_white_by_brown_to_black() {
    let brightness = |c: [u8; 3]| c.iter().map(|v| u32::from(*v)).sum::<u32>();
    let (paper, scorched, char) = (display_color(293.0, 0.0), display_color(600.0, 0.0), display_color(900.0, 1.0));
    assert!(brightness(paper) > 650 && brightness(scorched) < 350 && brightness(char) < 60);
    assert!(scorched[0] > scorched[1] && scorched[1] > scorched[2]);
}

#[test]
fn every_exporter_has_a_file() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/exporters");
    for row in EXPORTERS {
        assert!(folder.join(format!("{}.rs", row.name)).is_file() && !row.about.is_empty(), "{}", row.name);
    }
    let shared = [
        "mod",
        "glb",
        "abc_points",
        "abc_samples",
        "listing",
        "look",
        "ogawa",
        "pictures",
        "quantities",
        "sequence",
        "surface",
        "twin",
        "twin_obj",
        "usd_crate",
        "usd_points",
        "usd_samples",
        "vdb_grid",
    ];
    for entry in std::fs::read_dir(folder).unwrap() {
        let name = entry.unwrap().path().file_stem().unwrap().to_string_lossy().to_string();
        assert!(shared.contains(&name.as_str()) || EXPORTERS.iter().any(|row| row.name == name), "{name}");
    }
}

#[test]
fn runs_with_nothing_left_and_runs_of_chains_are_exported_or_refused_in_words() {
    let burnt = Folder::new("burnt-away");
    let mut writer = CacheWriter::create(&burnt.0, &RunInfo { fps: 24.0, ..RunInfo::default() }).unwrap();
    let mut state = sheet(4);
    writer.write(&Frame::of(&state, 0, 0.0), &[], &state).unwrap();
    state.triangles.alive.fill(0);
    state.motion.alive.fill(0);
    writer.write(&Frame::of(&state, 1, 1.0 / 24.0), &[], &state).unwrap();
    let chain = Folder::new("chain");
    let mut writer = CacheWriter::create(&chain.0, &RunInfo { fps: 24.0, ..RunInfo::default() }).unwrap();
    state.triangles = Default::default();
    writer.write(&Frame::of(&state, 0, 0.0), &[], &state).unwrap();

    for row in EXPORTERS {
        for (run, needs_faces) in [(&burnt, false), (&chain, true)] {
            let out = Folder::new(&format!("nothing-{}", row.name));
            let cache = CacheReader::open(&run.0).unwrap();
            let options = ExportOptions { resolution: 16, ..ExportOptions::default() };
            let result = export(&cache, row.name, &options, &out.0, &mut |_| ControlFlow::Continue(()));
            match row.name {
                "usd_twin" | "pc2" | "mdd" | "vat" | "gltf" | "maps" if needs_faces => {
                    let message = result.unwrap_err().to_string();
                    let words = ["no living face", "no texture coordinates"];
                    assert!(words.iter().any(|words| message.contains(words)), "{}: {message}", row.name);
                    assert_eq!(std::fs::read_dir(&out.0).unwrap().count(), 0, "{}", row.name);
                }
                _ => assert!(!result.unwrap().files.is_empty(), "{}", row.name),
            }
        }
    }
}

#[test]
fn flames_are_volumes_of_every_frame_and_errors_leave_nothing_half_written() {
    let run = Folder::new("flames");
    let mut state = sheet(9);
    state.burn.area.fill(1e-4);
    let mut writer = CacheWriter::create(&run.0, &RunInfo { fps: 24.0, ..RunInfo::default() }).unwrap();
    for number in 0..4 {
        // The fire begins with the second frame.
        let burning = (20..60).filter(|_| number > 0);
        burning.for_each(|i| (state.burn.burn_rate[i], state.burn.flame[i]) = (1e-6, 0.003));
        writer.write(&Frame::of(&state, number, f64::from(number) / 24.0), &[], &state).unwrap();
    }
    let cache = CacheReader::open(&run.0).unwrap();
    let out = Folder::new("flames-out");
    let go = |options: &ExportOptions| export(&cache, "vdb", options, &out.0, &mut |_| ControlFlow::Continue(()));
    let contents = |files: &[std::path::PathBuf]| files.iter().map(|f| std::fs::read(f).unwrap()).collect::<Vec<_>>();
    let plain = ExportOptions::default();
    let files = go(&plain).unwrap().files;
    let names: Vec<_> = files.iter().map(|file| file.file_name().unwrap().to_string_lossy().into_owned()).collect();
    assert_eq!(names, [0, 1, 2, 3].map(|n| format!("flames_{n:05}.vdb")));
    let bytes = contents(&files);
    assert!(bytes.iter().all(|bytes| bytes.starts_with(b" BDV")));
    assert!(bytes[0].len() < 1000 && bytes[1].len() > 10_000, "{} {}", bytes[0].len(), bytes[1].len());
    assert!(bytes[1] != bytes[2], "flames lick");
    assert!(contents(&go(&plain).unwrap().files) == bytes, "another time, other bytes");
    let fine = go(&ExportOptions { voxel: 1e-3, ..plain.clone() }).unwrap().files;
    let (fine, coarse) = (contents(&fine)[1].len(), bytes[1].len());
    assert!(fine > 4 * coarse, "{fine} {coarse}");
    for voxel in [0.0, -1.0, 1.0, f64::NAN] {
        let message = go(&ExportOptions { voxel, ..plain.clone() }).unwrap_err().to_string();
        assert!(message.contains("cannot be made") && message.contains("--voxel"), "{message}");
    }

    let frame = run.0.join("cache/frame_00002.npz");
    let whole = std::fs::read(&frame).unwrap();
    std::fs::write(&frame, &whole[..whole.len() / 2]).unwrap();
    let message = go(&plain).unwrap_err().to_string();
    assert!(message.contains("frame_00002.npz"), "{message}");
    let left: Vec<_> =
        std::fs::read_dir(&out.0).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    assert!(!left.iter().any(|name| name.ends_with(".partial")), "{left:?}");
    // Files are by frame: one that is missing leaves a gap.
    std::fs::remove_file(&frame).unwrap();
    let exported = go(&plain).unwrap();
    assert_eq!((exported.files.len(), exported.removed), (3, 1));

    // The model of 2004 burns by glow.
    let glowing = Folder::new("glowing");
    state.burn.burn_rate_full.fill(1e-6);
    let mut writer = CacheWriter::create(&glowing.0, &RunInfo { fps: 24.0, ..RunInfo::default() }).unwrap();
    writer.write(&Frame::of(&state, 0, 0.0), &[], &state).unwrap();
    let cache = CacheReader::open(&glowing.0).unwrap();
    let message =
        export(&cache, "vdb", &plain, &glowing.0.join("out"), &mut |_| ControlFlow::Continue(())).unwrap_err();
    assert!(message.to_string().contains("has no flames"), "{message}");
}

#[test]
fn ply_has_particles_as_points_in_a_file_beside_the_surface() {
    let folder = Folder::new("particles");
    let mut frame = Frame::of(&sheet(3), 2, 0.1);
    frame.particles = charcloth::sheet::Particles::zeros(2);
    frame.particles.mass[1] = 3e-6;
    frame.particles.position[1].y = -0.25;
    write_frame(&frame, &folder.0.join("a.ply")).unwrap();
    let file = std::fs::File::open(folder.0.join("a.particles.ply")).unwrap();
    let ply = Parser::<DefaultElement>::new().read_ply(&mut std::io::BufReader::new(file)).unwrap();
    let points = &ply.payload["vertex"];
    assert_eq!(points.len(), 2);
    let (y, mass, id) = (&points[1]["y"], &points[1]["mass"], &points[1]["id"]);
    assert_eq!((y, mass, id), (&Property::Float(-0.25), &Property::Float(3e-6), &Property::UInt(1)));
    for name in ["x", "z", "vx", "vy", "vz", "area", "temperature", "parent", "birth", "lies"] {
        assert!(points[0].contains_key(name), "{name}");
    }
}
