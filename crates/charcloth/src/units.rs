//! Quantities: SI inside, always; scenes may say "5 mm" or "80 g/m2".
//!
//! A quantity in a scene is a bare number in SI or a string with a unit. The unit is parsed with its dimension, so any
//! spelling that comes to the right dimension is fine ("0.5 W/(m K)", "80 g/m2", "30 N m^-1"), and the wrong dimension
//! is an error that says what was expected. Units and prefixes: [Bipm2019].

use std::fmt;

/// Powers of metre, kilogram, second and kelvin.
pub type Dimension = [i32; 4];

/// A unit: how many SI units it is, what it measures, and the zero it counts from (degrees Celsius only).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Unit {
    factor: f64,
    offset: f64,
    dimension: Dimension,
}

const NONE: Dimension = [0, 0, 0, 0];

fn named_unit(name: &str) -> Option<Unit> {
    let plain = |factor, dimension| Some(Unit { factor, offset: 0.0, dimension });
    match name {
        "m" => plain(1.0, [1, 0, 0, 0]),
        "in" | "inch" => plain(0.0254, [1, 0, 0, 0]),
        "ft" => plain(0.3048, [1, 0, 0, 0]),
        "g" => plain(1e-3, [0, 1, 0, 0]),
        "s" => plain(1.0, [0, 0, 1, 0]),
        "min" => plain(60.0, [0, 0, 1, 0]),
        "h" => plain(3600.0, [0, 0, 1, 0]),
        "K" => plain(1.0, [0, 0, 0, 1]),
        "degC" | "°C" => Some(Unit { factor: 1.0, offset: 273.15, dimension: [0, 0, 0, 1] }),
        "N" => plain(1.0, [1, 1, -2, 0]),
        "J" => plain(1.0, [2, 1, -2, 0]),
        "W" => plain(1.0, [2, 1, -3, 0]),
        "Pa" => plain(1.0, [-1, 1, -2, 0]),
        "Hz" => plain(1.0, [0, 0, -1, 0]),
        "deg" | "°" => plain(std::f64::consts::PI / 180.0, NONE),
        "rad" | "1" => plain(1.0, NONE),
        "%" => plain(0.01, NONE),
        "mol" => plain(1.0, NONE), // an amount counts as a number: nothing here mixes the two
        _ => None,
    }
}

fn lookup(name: &str) -> Option<Unit> {
    if let Some(unit) = named_unit(name) {
        return Some(unit);
    }
    let prefixes =
        [("k", 1e3), ("M", 1e6), ("G", 1e9), ("c", 1e-2), ("m", 1e-3), ("u", 1e-6), ("µ", 1e-6), ("n", 1e-9)];
    for (prefix, factor) in prefixes {
        if let Some(rest) = name.strip_prefix(prefix)
            && ["m", "g", "s", "N", "J", "W", "Pa", "K", "Hz"].contains(&rest)
        {
            let unit = named_unit(rest)?;
            return Some(Unit { factor: unit.factor * factor, ..unit });
        }
    }
    None
}

/// Parses a product or quotient of units such as `g/m2`, `W/(m K)`, `N m^-1`.
fn parse_unit(text: &str) -> Result<Unit, String> {
    let mut unit = Unit { factor: 1.0, offset: 0.0, dimension: NONE };
    let mut sign = 1;
    let mut in_brackets = false;
    let mut parts = 0;
    let mut chars = text.chars().peekable();
    while let Some(&c) = chars.peek() {
        match c {
            ' ' | '*' | '.' | '·' => {
                chars.next();
            }
            '/' => {
                chars.next();
                sign = -1;
            }
            '(' => {
                chars.next();
                in_brackets = true;
            }
            ')' => {
                chars.next();
                in_brackets = false;
                sign = 1;
            }
            _ => {
                let mut name = String::new();
                if c == '1' {
                    name.push('1');
                    chars.next();
                } else {
                    while let Some(&c) = chars.peek() {
                        if c.is_alphabetic() || c == '%' || c == '°' {
                            name.push(c);
                            chars.next();
                        } else {
                            break;
                        }
                    }
                }
                if name.is_empty() {
                    return Err(format!("'{c}' is not part of a unit"));
                }
                let mut power = String::new();
                if chars.peek() == Some(&'^') {
                    chars.next();
                }
                while let Some(&c) = chars.peek() {
                    if c.is_ascii_digit() || (c == '-' && power.is_empty()) {
                        power.push(c);
                        chars.next();
                    } else if c == '²' || c == '³' {
                        power.push(if c == '²' { '2' } else { '3' });
                        chars.next();
                    } else {
                        break;
                    }
                }
                let power: i32 = if power.is_empty() {
                    1
                } else {
                    power.parse().map_err(|_| format!("'{power}' is not a power"))?
                };
                let found = lookup(&name).ok_or_else(|| format!("'{name}' is not a unit known here"))?;
                let power = power * sign;
                unit.factor *= found.factor.powi(power);
                unit.offset = found.offset;
                for k in 0..4 {
                    unit.dimension[k] += found.dimension[k] * power;
                }
                if power != 1 || parts > 0 {
                    unit.offset = 0.0; // a product of degrees counts differences
                }
                parts += 1;
                if !in_brackets {
                    sign = 1;
                }
            }
        }
    }
    Ok(unit)
}

/// Splits "80 g/m2" into its number and its unit.
fn split_number(text: &str) -> Result<(f64, &str), String> {
    let text = text.trim();
    let mut end = 0;
    for (position, c) in text.char_indices() {
        let exponent = matches!(c, 'e' | 'E')
            && text[position + 1..].starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+')
            && end > 0;
        let sign = matches!(c, '+' | '-') && (position == 0 || text[..position].ends_with(['e', 'E']));
        if c.is_ascii_digit() || c == '.' || c == '_' || exponent || sign {
            end = position + c.len_utf8();
        } else {
            break;
        }
    }
    let number = text[..end].replace('_', "");
    let value: f64 = number.parse().map_err(|_| format!("'{text}' does not begin with a number"))?;
    Ok((value, text[end..].trim()))
}

/// Parses a quantity of the given dimension to SI.
pub fn parse(text: &str, dimension: Dimension, what: &str, example: &str) -> Result<f64, String> {
    let (value, unit_text) = split_number(text)?;
    if unit_text.is_empty() {
        return Ok(value);
    }
    let unit = parse_unit(unit_text).map_err(|problem| format!("{problem}; expected {what}, such as \"{example}\""))?;
    if unit.dimension != dimension {
        return Err(format!("\"{text}\" is {}; expected {what}, such as \"{example}\"", describe(unit.dimension)));
    }
    Ok(value * unit.factor + unit.offset)
}

/// Names a dimension in words where it has a name.
fn describe(dimension: Dimension) -> String {
    let known = [
        (NONE, "a plain number"),
        ([1, 0, 0, 0], "a length"),
        ([2, 0, 0, 0], "an area"),
        ([0, 1, 0, 0], "a mass"),
        ([0, 0, 1, 0], "a time"),
        ([0, 0, 0, 1], "a temperature"),
        ([-2, 1, 0, 0], "a mass per area"),
        ([1, 0, -1, 0], "a speed"),
        ([1, 1, -2, 0], "a force"),
        ([0, 1, -2, 0], "a force per length"),
        ([-1, 1, -2, 0], "a pressure"),
        ([2, 1, -2, 0], "an energy"),
        ([2, 1, -3, 0], "a power"),
    ];
    if let Some((_, name)) = known.iter().find(|(d, _)| *d == dimension) {
        return (*name).to_owned();
    }
    let mut text = String::from("in");
    for (symbol, power) in ["m", "kg", "s", "K"].iter().zip(dimension) {
        match power {
            0 => {}
            1 => text.push_str(&format!(" {symbol}")),
            p => text.push_str(&format!(" {symbol}^{p}")),
        }
    }
    text
}

macro_rules! quantities {
    ($($(#[$doc:meta])* $name:ident = $what:literal, $unit:literal, $dimension:expr, $example:literal;)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Default)]
        pub struct $name(pub f64);

        impl $name {
            /// SI unit of the number inside.
            pub const UNIT: &'static str = $unit;

            /// Parses a bare SI number or a number with a unit.
            pub fn parse(text: &str) -> Result<Self, String> {
                parse(text, $dimension, $what, $example).map(Self)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "{} {}", self.0, $unit)
            }
        }

        impl<'de> serde::Deserialize<'de> for $name {
            fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct Visitor;
                impl serde::de::Visitor<'_> for Visitor {
                    type Value = f64;
                    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                        write!(f, "{} in {} or with a unit, such as \"{}\"", $what, $unit, $example)
                    }
                    fn visit_f64<E: serde::de::Error>(self, v: f64) -> Result<f64, E> { Ok(v) }
                    fn visit_i64<E: serde::de::Error>(self, v: i64) -> Result<f64, E> { Ok(v as f64) }
                    fn visit_u64<E: serde::de::Error>(self, v: u64) -> Result<f64, E> { Ok(v as f64) }
                    fn visit_str<E: serde::de::Error>(self, v: &str) -> Result<f64, E> {
                        parse(v, $dimension, $what, $example).map_err(E::custom)
                    }
                }
                let value = deserializer.deserialize_any(Visitor)?;
                if !value.is_finite() {
                    return Err(serde::de::Error::custom(concat!("expected a finite number for ", $what)));
                }
                Ok(Self(value))
            }
        }

        impl serde::Serialize for $name {
            fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_f64(self.0)
            }
        }

        impl schemars::JsonSchema for $name {
            fn schema_name() -> std::borrow::Cow<'static, str> { stringify!($name).into() }
            fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
                schemars::json_schema!({
                    "description": concat!($what, ": a number in ", $unit, ", or a string with a unit such as \"", $example, "\""),
                    "anyOf": [{ "type": "number" }, { "type": "string", "pattern": "^\\s*[-+]?[0-9._]" }],
                })
            }
        }
    )*};
}

quantities! {
    /// A pure number or a percentage.
    Ratio = "a number or percentage", "1", NONE, "20 %";
    /// An angle [rad]; strings may say degrees.
    Angle = "an angle", "rad", NONE, "30 deg";
    /// A length [m].
    Length = "a length", "m", [1, 0, 0, 0], "5 mm";
    /// A time [s].
    Time = "a time", "s", [0, 0, 1, 0], "2 s";
    /// A temperature [K]; strings may say degC.
    Temperature = "a temperature", "K", [0, 0, 0, 1], "20 degC";
    /// An area [m2].
    Area = "an area", "m2", [2, 0, 0, 0], "1 mm2";
    /// A mass per area [kg/m2].
    Grammage = "a mass per area", "kg/m2", [-2, 1, 0, 0], "80 g/m2";
    /// A mass [kg].
    Mass = "a mass", "kg", [0, 1, 0, 0], "5 g";
    /// A speed [m/s].
    Speed = "a speed", "m/s", [1, 0, -1, 0], "2 m/s";
    /// An acceleration [m/s2].
    Acceleration = "an acceleration", "m/s2", [1, 0, -2, 0], "9.81 m/s2";
    /// Heat per mass [J/kg].
    SpecificEnergy = "a heat per mass", "J/kg", [2, 0, -2, 0], "1.2 MJ/kg";
    /// Heat capacity per mass [J/(kg K)].
    SpecificHeat = "a heat capacity per mass", "J/(kg K)", [2, 0, -2, -1], "1300 J/(kg K)";
    /// Diffusivity [m2/s].
    Diffusivity = "a diffusivity", "m2/s", [2, 0, -1, 0], "4.3e-6 m2/s";
    /// Force per width of sheet [N/m].
    ForcePerWidth = "a force per width", "N/m", [0, 1, -2, 0], "200 N/m";
    /// A rate [1/s].
    Rate = "a rate", "1/s", [0, 0, -1, 0], "0.5 1/s";
    /// Something per kelvin [1/K].
    PerKelvin = "a number per kelvin", "1/K", [0, 0, 0, -1], "3e-4 1/K";
    /// Modulus of elasticity, a pressure [Pa].
    Modulus = "a pressure", "Pa", [-1, 1, -2, 0], "5 GPa";
    /// Pressure per kelvin [Pa/K].
    PressurePerKelvin = "a pressure per kelvin", "Pa/K", [-1, 1, -2, -1], "0.01 Pa/K";
    /// Force times length per kelvin of difference [N m/K]: the raw k4.
    ThermalForce = "a force times a length per kelvin", "N m/K", [2, 1, -2, -1], "1e-9 N m/K";
    /// Force per kelvin [N/K]: the raw k5.
    ForcePerKelvin = "a force per kelvin", "N/K", [1, 1, -2, -1], "1e-8 N/K";
    /// Pressure per speed [Pa s/m], the wind coefficient.
    DragCoefficient = "a pressure per speed", "Pa s/m", [-2, 1, -1, 0], "0.5 Pa s/m";
    /// Conductance times length [W m/K]: the raw k0.
    ConductanceLength = "a power times a length per kelvin", "W m/K", [3, 1, -3, -1], "1e-6 W m/K";
    /// Mass per time [kg/s]: the raw k1.
    MassRate = "a mass per time", "kg/s", [0, 1, -1, 0], "1e-7 kg/s";
    /// Pressure [Pa].
    Pressure = "a pressure", "Pa", [-1, 1, -2, 0], "101.3 kPa";
    /// Heat per area and time [W/m2].
    HeatFlux = "a heat flux", "W/m2", [0, 1, -3, 0], "25 kW/m2";
    /// Energy per amount of substance [J/mol].
    MolarEnergy = "an energy per mole", "J/mol", [2, 1, -2, 0], "195 kJ/mol";
    /// Mass per volume [kg/m3].
    Density = "a mass per volume", "kg/m3", [-3, 1, 0, 0], "740 kg/m3";
    /// Thermal conductivity [W/(m K)].
    Conductivity = "a thermal conductivity", "W/(m K)", [1, 1, -3, -1], "0.07 W/(m K)";
    /// Bending stiffness per width [N m].
    BendingStiffness = "a bending stiffness per width", "N m", [2, 1, -2, 0], "0.4 mN m";
    /// Rise of specific heat with temperature [J/(kg K2)].
    SpecificHeatSlope = "a heat capacity per mass and kelvin", "J/(kg K2)", [2, 0, -2, -2], "2 J/(kg K2)";
    /// Raw k3 [K/(J kg)].
    HeatingCoefficient = "kelvin per joule and kilogram", "K/(J kg)", [-2, -2, 2, 1], "1e9 K/(J kg)";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_come_out_in_si() {
        let close =
            |a: Result<f64, String>, b: f64| assert!((a.clone().unwrap() - b).abs() <= 1e-12 * b.abs(), "{a:?} {b}");
        close(Length::parse("5 mm").map(|q| q.0), 0.005);
        close(Length::parse("5mm").map(|q| q.0), 0.005);
        close(Length::parse("0.3").map(|q| q.0), 0.3);
        close(Temperature::parse("20 degC").map(|q| q.0), 293.15);
        close(Temperature::parse("-5.5 °C").map(|q| q.0), 267.65);
        close(Grammage::parse("80 g/m2").map(|q| q.0), 0.08);
        close(Grammage::parse("80 g m^-2").map(|q| q.0), 0.08);
        close(SpecificHeat::parse("1.3 kJ/(kg K)").map(|q| q.0), 1300.0);
        close(SpecificHeat::parse("1.3 kJ/kg/K").map(|q| q.0), 1300.0);
        close(Diffusivity::parse("4.3 mm2/s").map(|q| q.0), 4.3e-6);
        close(Angle::parse("90 deg").map(|q| q.0), std::f64::consts::FRAC_PI_2);
        close(Ratio::parse("12.5 %").map(|q| q.0), 0.125);
        close(Time::parse("2e-3 min").map(|q| q.0), 0.12);
        close(PerKelvin::parse("3e-4 1/K").map(|q| q.0), 3e-4);
        close(PerKelvin::parse("3e-4/K").map(|q| q.0), 3e-4);
    }

    #[test]
    fn a_wrong_unit_says_what_was_expected() {
        let error = Length::parse("5 s").unwrap_err();
        assert!(error.contains("a time") && error.contains("a length") && error.contains("5 mm"), "{error}");
        assert!(Length::parse("5 furlong").unwrap_err().contains("furlong"));
        assert!(Length::parse("mm").unwrap_err().contains("number"));
        assert!(Grammage::parse("80 g").unwrap_err().contains("a mass"));
    }
}
