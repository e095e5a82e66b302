//! A real run, stopped and taken up again through the cache, is the run that was never stopped.

mod common;

use charcloth::random::Random;
use charcloth::simulation::{Inputs, Simulation};
use charcloth_io::cache::{CacheReader, CacheWriter, RunInfo};
use common::{Folder, tearing_scene};
use std::fs;
use std::path::Path;
use std::time::Duration;

const LAST: u32 = 14;

fn info() -> RunInfo {
    RunInfo { scene: "resumed".into(), fps: 24.0, ..RunInfo::default() }
}

/// Goes on from whatever the folder holds, to frame `last`. Without `finish` it stops as a killed run does.
fn go_on(folder: &Path, last: u32, every: Duration) -> Simulation {
    let (inputs, scene) = (Inputs::default(), tearing_scene());
    let fresh = CacheWriter::create(folder, &info());
    let (mut writer, mut simulation) = match fresh {
        Ok(writer) => (writer, Simulation::build(&scene, &inputs).unwrap()),
        Err(_) => {
            let (writer, checkpoint) = CacheWriter::resume(folder, &info()).unwrap();
            (writer, Simulation::resume(&scene, &inputs, checkpoint.state).unwrap())
        }
    };
    writer = writer.checkpoint_every(every);
    simulation.run(last, &mut writer).unwrap();
    simulation
}

#[test]
fn a_run_stopped_at_any_frame_ends_with_the_same_bits() {
    let straight = Folder::new("resume-straight");
    let end = go_on(&straight.0, LAST, Duration::ZERO);
    let nodes = Simulation::build(&tearing_scene(), &Inputs::default()).unwrap().state().motion.len();
    assert!(end.state().motion.len() > nodes, "the scene is one that tears");
    let file = |folder: &Folder, name: &str| fs::read(folder.0.join(name)).unwrap();

    let mut random = Random::new(7, 1);
    let stopped = Folder::new("resume-stopped");
    for _ in 0..3 {
        // Stopped here, with frames behind the checkpoint that must not survive.
        let stop = 1 + (random.uniform() * f64::from(LAST - 3)) as u32;
        let _ = fs::remove_dir_all(&stopped.0);
        go_on(&stopped.0, stop, Duration::ZERO);
        let checkpoint = file(&stopped, "cache/checkpoint.npz");
        go_on(&stopped.0, stop + 2, Duration::from_secs(3600));
        fs::write(stopped.0.join("cache/checkpoint.npz"), checkpoint).unwrap();

        let resumed = go_on(&stopped.0, LAST, Duration::ZERO);
        assert_eq!(resumed.state().hash(), end.state().hash(), "stopped at {stop}");
        let cache = CacheReader::open(&stopped.0).unwrap();
        assert_eq!(cache.frames().unwrap(), (0..=LAST).collect::<Vec<_>>());
        let frames = (0..=LAST).map(|number| format!("cache/frame_{number:05}.npz"));
        for name in frames.chain(["cache/checkpoint.npz", "history.csv"].map(str::to_owned)) {
            assert!(file(&stopped, &name) == file(&straight, &name), "{name} differs, stopped at {stop}");
        }
    }
}
