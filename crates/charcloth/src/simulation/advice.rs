//! What the user should know of a run, and what may be behind a failure.

use super::Simulation;

impl Simulation {
    fn warn_once(&mut self, warning: String, about: &str) {
        if !self.warnings.iter().any(|known| known.starts_with(about)) {
            self.warnings.push(warning);
        }
    }

    pub(super) fn warn_if_unstable(&mut self) {
        if self.last.stalled {
            let about = "time.step: motion is not solved to its tolerance";
            let message = format!("{about} (first at {:.4} s); shorten time.step", self.time());
            self.warn_once(message, about);
        }
        if self.built.state.books.scenery_lag[0] > 0.0 {
            let about = "obstacle: a sheet that cannot give way holds up what presses on it";
            let message =
                format!("{about} (first at {:.4} s); let obstacles leave it room, or move slower", self.time());
            self.warn_once(message, about);
        }
        if self.last.courant > 1.0 {
            let about = "time.substeps: the forced substep is unstable";
            let message = format!(
                "{about}: it is {:.2} times the longest stable one (first at {:.4} s); leave substeps out, or ask for {} \
                 and more",
                self.last.courant,
                self.time(),
                (f64::from(self.last.substeps) * self.last.courant).ceil()
            );
            self.warn_once(message, about);
        }
    }

    pub(super) fn warn_if_too_light(&mut self) {
        if self.scene.mechanics.moves && self.scene.mechanics.inert_fraction.0 <= 0.0 {
            let about = "mechanics.inert_fraction: at 0 a burnt node has no mass and no step is stable";
            self.warn_once(format!("{about}; 0.1 is the default"), about);
        }
    }

    pub(super) fn likeliest_cause(&self, field: &str) -> String {
        let unstable = self.last.courant > 1.0;
        match field {
            "position" | "velocity" if unstable => format!(
                "time.substeps forces a substep {:.1} times the longest stable one; leave it out",
                self.last.courant
            ),
            "position" | "velocity" => {
                "forces too strong for the sheet: lower curl.pressure, thermal_force.contraction or the wind, or shorten \
                 time.step"
                    .to_owned()
            }
            "temperature" | "peak_temperature" => {
                "heat of combustion too large for the heat capacity: check fire.heat_of_combustion and \
                 fire.heat_capacity"
                    .to_owned()
            }
            _ => "a value of the scene out of all proportion".to_owned(),
        }
    }
}
