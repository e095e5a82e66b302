//! A few random scenes; `charcloth fuzz` runs as many as one likes.

use charcloth_io::fuzz::{scene, try_scene};

#[test]
fn random_scenes_run_to_their_end_with_closed_books() {
    let mut wrong = Vec::new();
    let mut burnt = 0;
    for seed in 9..=16 {
        match try_scene(&scene(seed)) {
            Ok(summary) => burnt += u32::from(summary.fuel_burnt_kg > 0.0),
            Err(problem) => wrong.push(format!("seed {seed}: {problem}")),
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(burnt >= 2, "only {burnt} of 8 burn");
}

#[test]
fn what_goes_wrong_is_told() {
    let refused = try_scene("sheet.shape = \"cube\"\n").unwrap_err();
    assert!(refused.contains("cube"), "{refused}");
    // A forced substep that is far too long: positions do not stay finite.
    let wild = "mechanics.structural = 1e9\ntime = { frames = 30, substeps = 1 }\ninitial.velocity = [0, 0, 1]\n\
                sheet = { spacing = 0.02, cockle = 0.001 }\ninitial.stretch = [1.5, 1.5, 1.0]\n\
                mechanics.deformation_limit = 0\n";
    let wild = try_scene(wild).unwrap_err();
    assert!(wild.contains("past all bounds"), "{wild}");
    assert_eq!(scene(7), scene(7));
    assert_ne!(scene(7), scene(8));
}
