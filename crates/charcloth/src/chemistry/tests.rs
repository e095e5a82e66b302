use super::*;
use crate::substances::SUBSTANCE_TABLE;

const AIR: Surroundings =
    Surroundings { heat: 0.0, heat_slope: 0.0, about: 300.0, oxygen_fraction: 0.21, oxygen_supply: f64::INFINITY };
const NITROGEN: Surroundings = Surroundings { oxygen_fraction: 0.0, oxygen_supply: 0.0, ..AIR };
const DRY_ROOM: Room = Room { temperature: 293.15, relative_humidity: 0.0 };
const ROOM: Room = Room { temperature: 293.15, relative_humidity: 0.5 };

fn masses(pairs: &[(Substance, f64)]) -> Masses {
    let mut masses = [0.0; SUBSTANCES];
    for (substance, mass) in pairs {
        masses[*substance as usize] = *mass;
    }
    masses
}

fn reaction(name: &str, reactant: Substance, products: Masses, kinetics: (f64, f64, f64)) -> Reaction {
    let (frequency, activation_energy, order) = kinetics;
    Reaction {
        name: name.to_owned(),
        reactant,
        products,
        fuel_fraction: 1.0,
        oxygen: 0.0,
        frequency,
        activation_energy,
        order,
        oxygen_exponent: 0.0,
        heat: Some(0.0),
        heat_temperature: REFERENCE_TEMPERATURE,
    }
}

fn bare(composition: Masses, reactions: Vec<Reaction>) -> ChemistryData {
    ChemistryData {
        composition,
        specific_heats: SUBSTANCE_TABLE.map(|row| row.specific_heat),
        heats_of_combustion: masses(&[
            (Substance::Fibre, 16.1e6),
            (Substance::Polymer, 22e6),
            (Substance::YoungChar, 25e6),
            (Substance::Char, 25e6),
            (Substance::Filler, -1.78e6),
        ]),
        oxygen_demands: masses(&[
            (Substance::Fibre, 1.185),
            (Substance::Polymer, 1.67),
            (Substance::YoungChar, 1.65),
            (Substance::Char, 1.65),
        ]),
        moisture: Moisture {
            at_half_humidity: 0.06,
            isotherm_exponent: 1.8,
            frequency: 5.13e10,
            activation_energy: 88e3,
            heat: 2.44e6,
        },
        reactions,
    }
}

/// The scheme of a cellulosic paper [Kashiwagi1992], with filler that breaks down and a slow loss of char besides.
fn paper() -> ChemistryData {
    use Substance::*;
    let pyrolysis = Reaction {
        heat: Some(-570e3),
        heat_temperature: 620.0,
        ..reaction("pyrolysis", Fibre, masses(&[(YoungChar, 0.24)]), (1.803e15, 220e3, 1.8))
    };
    let oxidative = Reaction {
        heat: Some(5.0e6),
        oxygen: 0.41,
        oxygen_exponent: 0.5,
        fuel_fraction: 0.5,
        ..reaction("oxidative", Fibre, masses(&[(YoungChar, 0.21)]), (4.276e11, 160e3, 1.3))
    };
    let ageing = reaction("ageing", YoungChar, masses(&[(Char, 0.7)]), (2.6e-2, 17e3, 1.0));
    let glow = |name, reactant| Reaction {
        heat: None,
        oxygen: 1.65,
        oxygen_exponent: 0.78,
        fuel_fraction: 0.0,
        ..reaction(name, reactant, masses(&[(Ash, 0.03)]), (5.667e9, 160e3, 1.0))
    };
    let calcination = Reaction {
        heat: None,
        fuel_fraction: 0.0,
        ..reaction("calcination", Filler, masses(&[(Ash, 0.56)]), (1.78e6, 176.3e3, 0.5))
    };
    let composition = masses(&[(Fibre, 0.8), (Filler, 0.2)]);
    bare(
        composition,
        vec![pyrolysis, oxidative, ageing, glow("young glow", YoungChar), glow("glow", Char), calcination],
    )
}

/// Books of a call: errors of mass, sensible heat and chemical energy over their scales.
fn audit(chemistry: &Chemistry, before: &Layer, after: &Layer, out: &Released) -> f64 {
    let mass = |layer: &Layer| layer.masses.iter().sum::<f64>();
    let of_mass = mass(before) + out.oxygen_taken - mass(after) - out.volatiles - out.steam - out.oxides;
    let reactions = out.heat_of_drying + out.heat_of_pyrolysis + out.heat_of_oxidation;
    let sensible = |layer: &Layer| chemistry.sensible_heat(&layer.masses, layer.temperature);
    let of_heat = sensible(after) - sensible(before) - out.heat_in - reactions + out.heat_carried;
    let of_energy = chemistry.chemical_energy(&before.masses)
        - chemistry.chemical_energy(&after.masses)
        - reactions
        - out.volatile_energy;
    let heats = [sensible(before), sensible(after), out.heat_in, reactions, out.heat_carried];
    let scale_of_heat = heats.iter().fold(1e-300, |sum: f64, heat| sum + heat.abs());
    let scale_of_energy = before.masses.iter().sum::<f64>() * 2e7;
    let errors = [of_mass / mass(before), of_heat / scale_of_heat, of_energy / scale_of_energy];
    errors.iter().fold(0.0, |most: f64, error| most.max(error.abs()))
}

#[test]
fn books_close_whatever_the_step() {
    let chemistry = Chemistry::build(&paper(), ROOM).unwrap();
    let mut random = 1u64;
    let mut uniform = || {
        random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (random >> 11) as f64 / (1u64 << 53) as f64
    };
    let (mut worst, mut most_substeps) = (0.0f64, 0);
    for _ in 0..2_000 {
        let mut layer = chemistry.layer(1e-8 + 1e-6 * uniform());
        for k in 0..SUBSTANCES {
            layer.masses[k] =
                if uniform() < 0.3 { 0.0 } else { layer.dry_mass * uniform() * 10f64.powf(-9.0 * uniform()) };
        }
        layer.masses[6] += 1e-3 * layer.dry_mass;
        layer.temperature = 200.0 + 1800.0 * uniform();
        let capacity = chemistry.heat_capacity(&layer.masses, layer.temperature);
        let dt = 10f64.powf(-6.0 + 10.0 * uniform());
        let surroundings = Surroundings {
            heat: capacity * (uniform() - 0.4) * 10f64.powf(4.0 * uniform()) / dt.max(1.0),
            heat_slope: if uniform() < 0.3 { 0.0 } else { -capacity * 10f64.powf(-3.0 + 8.0 * uniform()) },
            about: 300.0 + 1500.0 * uniform(),
            oxygen_fraction: 0.3 * uniform(),
            oxygen_supply: if uniform() < 0.3 {
                f64::INFINITY
            } else {
                layer.dry_mass * 10f64.powf(-4.0 + 6.0 * uniform())
            },
        };
        let before = layer;
        let out = chemistry.advance(&mut layer, &surroundings, dt);
        let error = audit(&chemistry, &before, &layer, &out);
        worst = worst.max(error);
        most_substeps = most_substeps.max(out.substeps);
        assert!(error < 1e-12 * f64::from(out.substeps.max(10)), "{error} {before:?} {surroundings:?} {dt} {out:?}");
        assert!(layer.masses.iter().all(|mass| *mass >= 0.0), "{layer:?}");
        assert!(
            layer.temperature >= 100.0 && layer.temperature.is_finite(),
            "{layer:?} {before:?} {surroundings:?} {dt}"
        );
        assert!(out.oxygen_taken <= surroundings.oxygen_supply * dt * (1.0 + 1e-12), "{out:?} {surroundings:?} {dt}");
        assert!(out.volatiles >= 0.0 && out.steam >= 0.0 && out.oxides >= 0.0 && out.oxygen_taken >= 0.0);
    }
    println!("worst error {worst:e}, most substeps {most_substeps}");
}

/// A half-layer in the path of a flame: heated by a flux that comes and goes, cooled by radiation, with air behind.
fn burn(chemistry: &Chemistry, dt: f64, oxygen: f64, supply: f64) -> (Layer, Released, Vec<(f64, f64)>) {
    let mut layer = chemistry.layer(0.04 * 1e-6);
    let (mut all, mut history) = (Released::default(), Vec::new());
    let steps = (3.0 / dt).round() as usize;
    for step in 0..steps {
        let time = (step as f64 + 0.5) * dt;
        let flux = 90e3 * (-((time - 0.6) / 0.25).powi(2)).exp();
        let temperature = layer.temperature;
        let loss = 5.67e-8 * (temperature.powi(4) - 293f64.powi(4)) + 20.0 * (temperature - 293.0);
        let surroundings = Surroundings {
            heat: 1e-6 * (flux - loss),
            heat_slope: -1e-6 * (4.0 * 5.67e-8 * temperature.powi(3) + 20.0),
            about: temperature,
            oxygen_fraction: oxygen,
            oxygen_supply: supply * 1e-6,
        };
        let out = chemistry.advance(&mut layer, &surroundings, dt);
        all.substeps += out.substeps;
        all.volatiles += out.volatiles;
        all.oxygen_taken += out.oxygen_taken;
        if (step + 1) % (steps / 30) == 0 {
            history.push((layer.temperature, layer.masses.iter().sum::<f64>() / layer.dry_mass));
        }
    }
    (layer, all, history)
}

#[test]
fn error_falls_at_second_order_and_is_small() {
    let chemistry = Chemistry::build(&paper(), ROOM).unwrap();
    for (oxygen, supply) in [(0.0, 0.0), (0.21, 5e-3), (0.1, 2e-3)] {
        let (_, _, reference) = burn(&chemistry, 5e-5, oxygen, supply);
        let mut errors = Vec::new();
        for dt in [2e-2, 1e-2, 5e-3, 2e-3, 1e-3] {
            let (_, all, history) = burn(&chemistry, dt, oxygen, supply);
            let mut worst = (0.0f64, 0.0f64);
            for (a, b) in history.iter().zip(&reference) {
                worst = (worst.0.max((a.0 - b.0).abs()), worst.1.max((a.1 - b.1).abs()));
            }
            println!("oxygen {oxygen} dt {dt}: {worst:?} substeps {} of {}", all.substeps, 3.0 / dt);
            errors.push(worst);
        }
        // Substeps adapt to the reactions, so the error stops falling where it is small enough.
        assert!(errors.iter().all(|(kelvin, part)| *kelvin < 0.4 && *part < 4e-4), "{errors:?}");
        if oxygen == 0.0 {
            let order = (errors[0].0 / errors[2].0).log(4.0);
            assert!(order > 1.7, "{order}");
        }
    }
}

/// Unreacted part at a temperature [degC] after heating at a constant rate [K/min] from 400 K, from the exponential
/// integral: y = exp(-I), or (1 + (n - 1) I)^(-1/(n - 1)), with I = (A/b) (T exp(-E/RT) - (E/R) E1(E/RT)) between the two.
const SINGLE_STEP: &[(char, f64, f64, f64)] = &[
    ('a', 1.0, 280.0, 0.96622188),
    ('a', 1.0, 310.0, 0.71364679),
    ('a', 1.0, 340.0, 0.069834599),
    ('a', 10.0, 310.0, 0.96682602),
    ('a', 10.0, 350.0, 0.6020191),
    ('a', 10.0, 380.0, 0.043604353),
    ('a', 100.0, 340.0, 0.97373483),
    ('a', 100.0, 380.0, 0.73105994),
    ('a', 100.0, 420.0, 0.06126311),
    ('b', 1.0, 270.0, 0.96580765),
    ('b', 1.0, 300.0, 0.76704708),
    ('b', 1.0, 330.0, 0.11728255),
    ('b', 10.0, 300.0, 0.97482208),
    ('b', 10.0, 340.0, 0.75410031),
    ('b', 10.0, 380.0, 0.022991895),
    ('b', 100.0, 340.0, 0.97329397),
    ('b', 100.0, 390.0, 0.68988579),
    ('b', 100.0, 430.0, 0.02767519),
    ('c', 1.0, 310.0, 0.97436217),
    ('c', 1.0, 360.0, 0.45196518),
    ('c', 1.0, 400.0, 0.040559648),
    ('c', 10.0, 340.0, 0.97396574),
    ('c', 10.0, 400.0, 0.37349161),
    ('c', 10.0, 450.0, 0.021128047),
    ('c', 100.0, 370.0, 0.97851366),
    ('c', 100.0, 430.0, 0.51579887),
    ('c', 100.0, 490.0, 0.029431098),
    ('d', 1.0, 260.0, 0.96511961),
    ('d', 1.0, 300.0, 0.60197541),
    ('d', 1.0, 330.0, 0.050924691),
    ('d', 10.0, 290.0, 0.97334339),
    ('d', 10.0, 330.0, 0.74249381),
    ('d', 10.0, 370.0, 0.085995807),
    ('d', 100.0, 330.0, 0.97066481),
    ('d', 100.0, 380.0, 0.6705235),
    ('d', 100.0, 430.0, 0.023588888),
];

#[test]
fn a_single_step_under_a_ramp_is_exact() {
    let mut worst = (0.0f64, 0.0f64);
    for (set, rate, celsius, exact) in SINGLE_STEP {
        let kinetics = match set {
            'a' => (1.184e14, 194975.0, 1.0),
            'b' => (1.892e11, 162953.0, 0.67),
            'c' => (1.803e15, 220000.0, 1.8),
            _ => (2.0e11, 160000.0, 1.0),
        };
        let single = reaction("step", Substance::Fibre, [0.0; SUBSTANCES], kinetics);
        let chemistry = Chemistry::build(&bare(masses(&[(Substance::Fibre, 1.0)]), vec![single]), DRY_ROOM).unwrap();
        for (place, steps) in [(0, 20), (1, 400)] {
            let mut layer = chemistry.layer(1e-6);
            layer.temperature = 400.0;
            let rise = (celsius + 273.15 - 400.0) / f64::from(steps);
            for step in 0..steps {
                let end = 400.0 + rise * f64::from(step + 1);
                chemistry.advance_led(&mut layer, end, &NITROGEN, rise * 60.0 / rate);
            }
            let error = (layer.masses[1] / 1e-6 - exact).abs();
            if place == 0 { worst.0 = worst.0.max(error) } else { worst.1 = worst.1.max(error) }
        }
    }
    println!("single step: errors {worst:?}");
    assert!(worst.0 < 1e-3 && worst.1 < 1e-4, "{worst:?}");
}

#[test]
fn what_a_cold_layer_leaves_out_is_within_the_bound() {
    // The longest minute: held just under the temperature at which the early way out ends.
    let chemistry = Chemistry::build(&paper(), ROOM).unwrap();
    let wet = chemistry.layer(1e-6);
    let mut dry = wet;
    dry.masses[0] = 0.0;
    for (layer, idle, bound) in [
        (wet, chemistry.idle_below_wet, 60.0 * IDLE_DRYING),
        (dry, chemistry.idle_temperature(&dry.masses), 60.0 * 6.0 * IDLE_RATE),
    ] {
        assert!(idle > 295.0, "{idle}");
        let held = Layer { temperature: idle - 0.01, ..layer };
        let (mut skipped, mut reacted) = (held, held);
        let out = chemistry.advance(&mut skipped, &Surroundings { about: held.temperature, ..AIR }, 60.0);
        assert_eq!((out.substeps, skipped.masses), (0, held.masses));
        chemistry.advance_led(&mut reacted, held.temperature, &AIR, 60.0);
        let lost: f64 = held.masses.iter().zip(reacted.masses).map(|(a, b)| (a - b).abs()).sum();
        println!("idle below {idle} K, lost in a minute {:e} of the dry mass", lost / layer.dry_mass);
        assert!(lost <= bound * layer.dry_mass, "{idle} {lost}");
    }
}

#[test]
fn moisture_comes_to_balance_with_the_room() {
    let chemistry = Chemistry::build(&paper(), ROOM).unwrap();
    let mut layer = chemistry.layer(1.0);
    assert!((layer.masses[0] - 0.06).abs() < 1e-12);
    // An hour up to 105 degC: what is left is what Eq. 13.7 says, but for the lag, and it took the heat that it should.
    let out = chemistry.advance_led(&mut layer, 378.15, &NITROGEN, 3600.0);
    let left = chemistry.moisture_at(378.15) * layer.masses[1];
    assert!((layer.masses[0] - left).abs() < 3e-4, "{layer:?} {left}");
    assert!((out.steam - (0.06 - layer.masses[0])).abs() < 1e-12);
    assert!((out.heat_of_drying + 2.44e6 * out.steam).abs() < 1e-6);
    // Paper at 20 % and 80 % relative humidity.
    let moisture = paper().moisture;
    assert!(moisture.equilibrium(0.2) > 0.025 && moisture.equilibrium(0.2) < 0.04);
    assert!(moisture.equilibrium(0.8) > 0.08 && moisture.equilibrium(0.8) < 0.12);
}

#[test]
fn a_layer_held_by_its_surroundings_follows_them() {
    // dT/dt = -(T - 800 K)/tau, exact for a constant capacity whatever the step.
    let ash = Layer { masses: masses(&[(Substance::Ash, 1e-9)]), temperature: 300.0, dry_mass: 4e-8 };
    let chemistry = Chemistry::build(&paper(), ROOM).unwrap();
    let capacity = chemistry.heat_capacity(&ash.masses, 300.0);
    for ratio in [1e-6, 1e-3, 0.1, 1.0, 10.0, 1e3, 1e9] {
        let mut layer = ash;
        let surroundings = Surroundings { heat_slope: -capacity * ratio, about: 800.0, ..AIR };
        chemistry.advance(&mut layer, &surroundings, 1.0);
        let exact = 800.0 - 500.0 * (-ratio).exp();
        assert!((layer.temperature - exact).abs() < 1e-9, "{ratio} {} {exact}", layer.temperature);
    }
}

#[test]
fn exchange_is_exact_and_keeps_heat() {
    let chemistry = Chemistry::build(&paper(), ROOM).unwrap();
    let ash = |temperature, mass| Layer { masses: masses(&[(Substance::Ash, mass)]), temperature, dry_mass: 4e-8 };
    let (mut front, mut back) = (ash(900.0, 1e-9), ash(400.0, 3e-9));
    let heat = |layer: &Layer| chemistry.sensible_heat(&layer.masses, layer.temperature);
    let before = heat(&front) + heat(&back);
    let rate: f64 = 5e-7 * (1.0 / (838.0 * 1e-9) + 1.0 / (838.0 * 3e-9));
    let flow = chemistry.exchange(&mut front, &mut back, 5e-7, 1.0);
    assert!((front.temperature - back.temperature - 500.0 * (-rate).exp()).abs() < 1e-9);
    assert!((heat(&front) + heat(&back) - before).abs() < 1e-15 * before && flow > 0.0);
}

#[test]
fn what_cannot_be_is_refused() {
    let mut heavy = paper();
    heavy.reactions[0].products[3] = 1.2;
    assert!(Chemistry::build(&heavy, ROOM).unwrap_err().contains("weigh"));
    let mut hot = paper();
    hot.reactions[1].heat = Some(15e6);
    assert!(Chemistry::build(&hot, ROOM).unwrap_err().contains("too much"));
    let mut short = paper();
    short.composition[1] = 0.5;
    assert!(Chemistry::build(&short, ROOM).unwrap_err().contains("add up"));
}

#[test]
#[ignore = "a benchmark: cargo test --release -- --ignored --nocapture nanoseconds"]
fn nanoseconds_a_half_layer() {
    use std::hint::black_box;
    use std::time::Instant;
    let chemistry = Chemistry::build(&paper(), ROOM).unwrap();
    let cold = chemistry.layer(4e-8);
    let mut dry = cold;
    dry.masses[0] = 0.0;
    let mut pyrolysing = dry;
    pyrolysing.temperature = 660.0;
    let mut glowing = dry;
    glowing.temperature = 900.0;
    glowing.masses = glowing.masses.map(|_| 0.0);
    glowing.masses[4] = 8e-9;
    glowing.masses[6] = 1e-9;
    let ash = Layer { masses: masses(&[(Substance::Ash, 1e-9)]), temperature: 700.0, dry_mass: 4e-8 };
    let warm = Layer { temperature: 340.0, ..cold };
    for (name, start, heating) in [
        ("cold, wet", cold, 0.0),
        ("dry, 400 K", Layer { temperature: 400.0, ..dry }, 100.0),
        ("drying", warm, 300.0),
        ("pyrolysing", pyrolysing, 500.0),
        ("glowing", glowing, 0.0),
        ("ash", ash, 0.0),
    ] {
        for dt in [1e-4, 1e-3, 1e-2] {
            let capacity = chemistry.heat_capacity(&start.masses, start.temperature);
            let surroundings = Surroundings {
                heat: capacity * heating,
                heat_slope: -capacity * 2.0,
                about: start.temperature,
                oxygen_fraction: 0.15,
                oxygen_supply: 5e-3 * 1e-6,
            };
            let count = 1000;
            let mut best = f64::INFINITY;
            let mut substeps = 0;
            for _ in 0..200 {
                let clock = Instant::now();
                substeps = 0;
                for _ in 0..count {
                    let mut layer = black_box(start);
                    substeps += black_box(chemistry.advance(&mut layer, black_box(&surroundings), dt)).substeps;
                }
                best = best.min(clock.elapsed().as_secs_f64());
            }
            let ns = best / f64::from(count) * 1e9;
            println!("{name:12} dt {dt:7} s: {ns:8.1} ns, {} substeps", f64::from(substeps) / f64::from(count));
        }
    }
}
