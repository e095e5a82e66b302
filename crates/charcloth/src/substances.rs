//! What a layer of sheet may be made of, and the gases that leave it or come in.
//!
//! Model: a fixed table of condensed substances, each with a specific heat that rises linearly with temperature, and of
//! gases with constant specific heats (Eq. 13.1, 13.2). A material may replace specific heats and says how much heat and
//! oxygen complete burning of each substance gives and takes. Valid when: 250 to 1500 K; melting of polymers is not
//! told apart. Cost: seven numbers a layer.

/// A condensed substance; `as usize` is its place in [`Masses`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(usize)]
pub enum Substance {
    /// Moisture, bound in the pores and walls of fibres.
    Water = 0,
    /// The fibre that burns: cellulose in paper and cotton, keratin in wool, fibroin in silk.
    Fibre = 1,
    /// A second one that burns by itself: polyester in a blend, the coating of a paper.
    Polymer = 2,
    /// What pyrolysis leaves at first: char that still loses gas when it is heated on.
    YoungChar = 3,
    /// Char that only oxygen takes away.
    Char = 4,
    /// Mineral filler, such as the calcium carbonate of copy paper.
    Filler = 5,
    /// What is left.
    Ash = 6,
}

/// Number of condensed substances.
pub const SUBSTANCES: usize = 7;

/// Mass of each substance [kg].
pub type Masses = [f64; SUBSTANCES];

/// Sensible heat and heats of reaction are counted from here [K]: 25 degC, as in tables of formation enthalpies.
pub const REFERENCE_TEMPERATURE: f64 = 298.15;

/// Specific heat that rises linearly with temperature: Eq. 13.1, `c = at_reference + slope (T - 298.15 K)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpecificHeat {
    /// At 298.15 K [J/(kg K)].
    pub at_reference: f64,
    /// Rise with temperature [J/(kg K2)].
    pub slope: f64,
}

/// A row of the table of substances.
#[derive(Debug, Clone, Copy)]
pub struct SubstanceRow {
    /// Which one.
    pub substance: Substance,
    /// Name in files.
    pub name: &'static str,
    /// One line about it.
    pub about: &'static str,
    /// Specific heat where the material gives none.
    pub specific_heat: SpecificHeat,
}

const fn constant(at_reference: f64) -> SpecificHeat {
    SpecificHeat { at_reference, slope: 0.0 }
}

/// Every condensed substance, in the order of [`Masses`].
pub static SUBSTANCE_TABLE: [SubstanceRow; SUBSTANCES] = [
    SubstanceRow {
        substance: Substance::Water,
        name: "water",
        about: "bound moisture",
        specific_heat: constant(4180.0), // tuned: liquid water, known to 1 %; bound water 4000 to 5000
    },
    SubstanceRow {
        substance: Substance::Fibre,
        name: "fibre",
        about: "the fibre that burns",
        // Dried cotton sheet, 1220 at 10 degC to 1349 at 40 degC [Fsri2022].
        // tuned: slope 2 of 0 to 4.3 (that range's own), so that the mean to 600 K is between 1450 and 1800 J/(kg K)
        specific_heat: SpecificHeat { at_reference: 1285.0, slope: 2.0 },
    },
    SubstanceRow {
        substance: Substance::Polymer,
        name: "polymer",
        about: "a second fibre or a coating",
        specific_heat: SpecificHeat { at_reference: 1170.0, slope: 2.0 }, // tuned: polyester, 1000 to 1350 at 25 degC
    },
    SubstanceRow {
        substance: Substance::YoungChar,
        name: "young_char",
        about: "char that still loses gas",
        specific_heat: constant(1300.0), // char of cardboard [Fds2024]
    },
    SubstanceRow {
        substance: Substance::Char,
        name: "char",
        about: "char that only oxygen takes",
        specific_heat: constant(1300.0), // char of cardboard [Fds2024]
    },
    SubstanceRow {
        substance: Substance::Filler,
        name: "filler",
        about: "mineral filler",
        specific_heat: constant(838.0), // calcium carbonate [ForestBioFacts2024]
    },
    SubstanceRow {
        substance: Substance::Ash,
        name: "ash",
        about: "what is left",
        specific_heat: constant(838.0), // tuned: as the filler, 700 to 1000
    },
];

/// A gas that goes through a face of the sheet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gas {
    /// Out: water vapour from drying.
    Steam,
    /// Out: fuel.
    Volatiles,
    /// Out: burnt gas (carbon oxides and water) made within the sheet.
    Oxides,
    /// In.
    Oxygen,
}

impl Gas {
    /// Mean specific heat at constant pressure between room and flame front [J/(kg K)].
    pub const fn specific_heat(self) -> f64 {
        match self {
            Gas::Steam => 2000.0,     // tuned: 1860 at 25 degC, 2150 at 700 K
            Gas::Volatiles => 1700.0, // tuned: 1100 to 2500, tar and permanent gas
            Gas::Oxides => 1200.0,    // tuned: CO2 0.85 to 1.2, CO 1.04 to 1.15, H2O 1.86 to 2.2 kJ/(kg K)
            Gas::Oxygen => 980.0,     // tuned: 918 at 25 degC, 1030 at 700 K
        }
    }
}

impl Substance {
    /// Finds a substance by its name in files.
    pub fn named(name: &str) -> Option<Self> {
        SUBSTANCE_TABLE.iter().find(|row| row.name == name).map(|row| row.substance)
    }

    /// Name in files.
    pub fn name(self) -> &'static str {
        SUBSTANCE_TABLE[self as usize].name
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_in_the_order_of_masses() {
        for (place, row) in SUBSTANCE_TABLE.iter().enumerate() {
            assert_eq!(row.substance as usize, place);
            assert_eq!(Substance::named(row.name), Some(row.substance));
        }
    }
}
