//! The chemistry of the built-in materials against thermogravimetry, and the integrator against closed forms.

use charcloth::chemistry::{Chemistry, ChemistryData, Layer, Room, Surroundings};
use charcloth::substances::Substance;
use charcloth_io::material_file::open;

const ROOM: Room = Room { temperature: 293.15, relative_humidity: 0.5 };

/// Cotton bed sheet in nitrogen at 10 K/min [Fsri2022]: temperature [degC], mass over that at 180 degC.
const COTTON: &[(f64, f64)] = &[
    (190.0, 0.99881),
    (306.5, 0.95837),
    (310.0, 0.95028),
    (315.0, 0.93556),
    (320.0, 0.91721),
    (325.0, 0.89444),
    (330.0, 0.86528),
    (335.0, 0.82884),
    (340.0, 0.78394),
    (345.0, 0.72845),
    (350.0, 0.66032),
    (355.0, 0.57965),
    (360.0, 0.48576),
    (365.0, 0.38759),
    (370.0, 0.29642),
    (375.0, 0.22397),
    (380.0, 0.17801),
    (385.0, 0.15869),
    (390.0, 0.15377),
    (728.0, 0.11251),
    (749.0, 0.11174),
];

fn surroundings(oxygen_fraction: f64) -> Surroundings {
    Surroundings { heat: 0.0, heat_slope: 0.0, about: 300.0, oxygen_fraction, oxygen_supply: f64::INFINITY }
}

/// Mass over dry mass, without water, at each of some rising temperatures [degC], heated at a rate [K/min] from 50 degC.
fn thermobalance(chemistry: &Chemistry, rate: f64, oxygen: f64, at: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut layer = chemistry.layer(1e-6);
    layer.temperature = 323.15;
    let surroundings = surroundings(oxygen);
    at.map(|celsius| {
        while layer.temperature < celsius + 273.15 {
            let end = (layer.temperature + 5.0).min(celsius + 273.15);
            let time = (end - layer.temperature) * 60.0 / rate;
            chemistry.advance_led(&mut layer, end, &surroundings, time);
        }
        dry_part(&layer)
    })
    .collect()
}

fn dry_part(layer: &Layer) -> f64 {
    (layer.masses.iter().sum::<f64>() - layer.masses[Substance::Water as usize]) / layer.dry_mass
}

fn rms(chemistry: &Chemistry) -> f64 {
    let ours = thermobalance(chemistry, 10.0, 0.0, COTTON.iter().map(|(celsius, _)| *celsius));
    // Measured masses are over that at 180 degC, where nothing but water has gone.
    let squares: f64 = ours.iter().zip(COTTON).map(|(ours, (_, measured))| (ours - measured).powi(2)).sum();
    (squares / COTTON.len() as f64).sqrt()
}

fn cotton() -> ChemistryData {
    open("cotton_sheet").unwrap().chemistry().unwrap()
}

/// What the fit changes: ln k at 628 K, E [kJ/mol], order and char of the pyrolysis; ln k at 750 K and yield of the char's
/// loss of gas.
fn with(parameters: &[f64; 6]) -> ChemistryData {
    let mut data = cotton();
    let [log_rate, energy, order, char, log_loss, kept] = *parameters;
    let frequency =
        |log_rate: f64, energy: f64, temperature: f64| (log_rate + energy / (8.314_462_618 * temperature)).exp();
    let energy = energy * 1e3;
    data.reactions[0].frequency = frequency(log_rate, energy, 628.0);
    data.reactions[0].activation_energy = energy;
    data.reactions[0].order = order;
    data.reactions[0].products[Substance::YoungChar as usize] = char;
    data.reactions[2].frequency = frequency(log_loss, data.reactions[2].activation_energy, 750.0);
    data.reactions[2].products[Substance::Char as usize] = kept;
    data
}

/// How the numbers of cotton_sheet.toml came to be: the simplex of Nelder and Mead from the single step of order 0.67.
/// Run with `cargo test --release -p charcloth-io --test tga -- --ignored --nocapture fit`.
#[test]
#[ignore = "a fit, not a check"]
fn fit() {
    let cost = |p: &[f64; 6]| {
        // One heating rate tells E and A hardly apart, nor char made from char kept: E stays at that of the single step,
        // and no more char is made than the mass left at 390 degC asks for.
        let inside = (0.3..2.5).contains(&p[2]) && (0.05..0.16).contains(&p[3]) && (0.3..1.0).contains(&p[5]);
        if !inside || (p[1] - 162.953).abs() > 0.5 {
            return 1.0;
        }
        Chemistry::build(&with(p), ROOM).map_or(1.0, |chemistry| rms(&chemistry))
    };
    let start = [-5.24, 162.953, 0.67, 0.156, -7.0, 0.73];
    let steps = [0.2, 0.2, 0.1, 0.005, 0.5, 0.03];
    let mut simplex: Vec<([f64; 6], f64)> = (0..7)
        .map(|corner| {
            let mut p = start;
            if corner > 0 {
                p[corner - 1] += steps[corner - 1];
            }
            (p, cost(&p))
        })
        .collect();
    for round in 0..300 {
        simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
        if round % 50 == 0 {
            println!("{round}: {:?}", simplex[0]);
        }
        let worst = simplex[6];
        let centre: [f64; 6] = std::array::from_fn(|k| simplex[..6].iter().map(|(p, _)| p[k]).sum::<f64>() / 6.0);
        let along = |t: f64| -> ([f64; 6], f64) {
            let p: [f64; 6] = std::array::from_fn(|k| centre[k] + t * (worst.0[k] - centre[k]));
            (p, cost(&p))
        };
        let reflected = along(-1.0);
        let next = if reflected.1 < simplex[0].1 {
            let further = along(-2.0);
            if further.1 < reflected.1 { further } else { reflected }
        } else if reflected.1 < simplex[5].1 {
            reflected
        } else {
            along(if reflected.1 < worst.1 { -0.5 } else { 0.5 })
        };
        if next.1 < worst.1 {
            simplex[6] = next;
        } else {
            let best = simplex[0].0;
            for (p, c) in &mut simplex[1..] {
                *p = std::array::from_fn(|k| 0.5 * (best[k] + p[k]));
                *c = cost(p);
            }
        }
    }
    let data = with(&simplex[0].0);
    println!("rms {}", simplex[0].1);
    println!("{:#?}\n{:#?}", data.reactions[0], data.reactions[2]);
}

#[test]
fn cotton_in_nitrogen_is_as_measured() {
    let chemistry = Chemistry::build(&cotton(), ROOM).unwrap();
    let error = rms(&chemistry);
    println!("rms {error}");
    for (celsius, ours) in COTTON.iter().zip(thermobalance(&chemistry, 10.0, 0.0, COTTON.iter().map(|row| row.0))) {
        println!("{},{},{ours:.5}", celsius.0, celsius.1);
    }
    assert!(error < 0.006, "{error}");
}

/// Temperature [degC] of the fastest loss of dry mass, the loss there [1/s], and the temperatures at which half of the
/// dry mass, and 95 %, are gone.
fn peak(chemistry: &Chemistry, rate: f64, oxygen: f64) -> (f64, f64, Option<f64>, Option<f64>) {
    let at: Vec<f64> = (200..1700).map(|half| f64::from(half) * 0.5).collect();
    let masses = thermobalance(chemistry, rate, oxygen, at.iter().copied());
    let (mut best, mut fastest) = (0.0, 0.0);
    for k in 1..at.len() {
        let loss = (masses[k - 1] - masses[k]) / (at[k] - at[k - 1]) * rate / 60.0;
        if loss > fastest {
            (best, fastest) = (0.5 * (at[k - 1] + at[k]), loss);
        }
    }
    let first_under = |level: f64| masses.iter().position(|mass| *mass < level).map(|k| at[k]);
    (best, fastest, first_under(0.5), first_under(0.05))
}

#[test]
fn peaks_move_with_the_heating_rate() {
    // [Fsri2022]: fastest at 363 degC, 3.9e-3 1/s of what is lost by 390 degC, 0.846 of the dry mass.
    let chemistry = Chemistry::build(&cotton(), ROOM).unwrap();
    for rate in [1.0, 5.0, 10.0, 20.0, 50.0] {
        let (celsius, fastest, half, _) = peak(&chemistry, rate, 0.0);
        println!("cotton, nitrogen, {rate} K/min: {celsius} degC, {fastest:.2e} 1/s, half at {half:?}");
        if rate == 10.0 {
            assert!(
                (celsius - 363.0).abs() < 3.0 && (fastest / 0.846 / 3.9e-3 - 1.0).abs() < 0.06,
                "{celsius} {fastest}"
            );
        }
    }
    // Peaks worked out from the scheme of [Kashiwagi1992] by itself: nitrogen 381 and 392 degC, air 338 and 350 degC, less
    // than 5 % left by 452 and 471 degC, at 5 and 10 K/min.
    let mut paper = open("filter_paper").unwrap().chemistry().unwrap();
    for young in [true, false] {
        if !young {
            // The scheme by itself: one char, that loses no gas.
            paper.reactions.retain(|reaction| reaction.name != "loss of gas by char");
        }
        let chemistry = Chemistry::build(&paper, ROOM).unwrap();
        for (rate, nitrogen, air, gone) in [(5.0, 381.0, 338.0, 452.0), (10.0, 392.0, 350.0, 471.0)] {
            let in_nitrogen = peak(&chemistry, rate, 0.0);
            let in_air = peak(&chemistry, rate, 0.21);
            println!("paper, loss of gas {young}, {rate} K/min: {in_nitrogen:?}, air {in_air:?}");
            if !young {
                assert!((in_nitrogen.0 - nitrogen).abs() < 1.0, "{in_nitrogen:?}");
                assert!((in_air.0 - air).abs() < 1.0, "{in_air:?}");
                assert!((in_air.3.unwrap() - gone).abs() < 2.0, "{in_air:?}");
            }
        }
    }
}

#[test]
#[ignore = "prints the curves that docs/pictures/chemistry.svg shows"]
fn curves() {
    let (cotton, paper) = (cotton(), open("filter_paper").unwrap().chemistry().unwrap());
    let at = || (200..=800).map(f64::from);
    for (name, data, rate, oxygen) in [
        ("cotton nitrogen 1 K/min", &cotton, 1.0, 0.0),
        ("cotton nitrogen 5 K/min", &cotton, 5.0, 0.0),
        ("cotton nitrogen 10 K/min", &cotton, 10.0, 0.0),
        ("cotton nitrogen 20 K/min", &cotton, 20.0, 0.0),
        ("cotton nitrogen 50 K/min", &cotton, 50.0, 0.0),
        ("paper nitrogen 10 K/min", &paper, 10.0, 0.0),
        ("paper air 10 K/min", &paper, 10.0, 0.21),
    ] {
        let chemistry = Chemistry::build(data, ROOM).unwrap();
        for (celsius, mass) in at().zip(thermobalance(&chemistry, rate, oxygen, at())) {
            println!("curve,{name},{celsius},{mass:.5}");
        }
    }
    for rate in [1.0, 10.0, 100.0, 1000.0] {
        let cotton = peak(&Chemistry::build(&cotton, ROOM).unwrap(), rate * 60.0, 0.0).0;
        let paper = peak(&Chemistry::build(&paper, ROOM).unwrap(), rate * 60.0, 0.0).0;
        println!("{rate} K/s: cotton {cotton} degC, paper {paper} degC");
    }
    for row in charcloth_io::material_file::MATERIALS {
        let material = open(row.name).unwrap();
        let chemistry = Chemistry::build(&material.chemistry().unwrap(), ROOM).unwrap();
        let (heat, oxygen) = chemistry.volatiles().unwrap();
        println!(
            "{}: dry {:.1} g/m2, volatiles {:.2} MJ/kg, {oxygen:.3} kg O2/kg",
            row.name,
            material.dry_grammage() * 1e3,
            heat / 1e6
        );
    }
}

/// Every source of a material begins with a key that stands in the references, or with one of the old ones.
#[test]
fn sources_of_materials_stand_in_the_references() {
    let top = concat!(env!("CARGO_MANIFEST_DIR"), "/../../");
    let references = std::fs::read_to_string(format!("{top}docs/references.md")).unwrap();
    for row in charcloth_io::material_file::MATERIALS {
        for rest in row.item.split("source = \"").skip(1) {
            let text = rest.split('"').next().unwrap_or("");
            let key = text.split([',', ':', ' ']).next().unwrap_or("");
            assert!(
                references.contains(&format!("**[{key}]**")),
                "{}: \"{text}\" has no key of docs/references.md",
                row.name
            );
        }
    }
}
