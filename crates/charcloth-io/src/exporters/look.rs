//! The colour that a node of paper shows where a program has nothing but a colour to show.

/// Paper that nothing has happened to, sRGB.
const PAPER: [f64; 3] = [244.0, 240.0, 228.0];
/// Scorched paper, sRGB.
const SCORCHED: [f64; 3] = [112.0, 66.0, 30.0];
/// Char, sRGB.
const CHAR: [f64; 3] = [18.0, 16.0, 15.0];
/// Peak temperatures [K] between which paper turns from white to brown. tuned: paper yellows from about 150 degrees
/// Celsius and is brown before it takes fire at about 230.
const SCORCH: [f64; 2] = [420.0, 540.0];

/// Colour of a node, sRGB 0 to 255: white paper, brown by the highest temperature [K] it has seen, black by how far it
/// has turned to char, 0 to 1.
pub fn display_color(peak_temperature: f64, charred: f64) -> [u8; 3] {
    let scorched = scorched(peak_temperature);
    let charred = charred.clamp(0.0, 1.0);
    std::array::from_fn(|k| {
        let paper = PAPER[k] + (SCORCHED[k] - PAPER[k]) * scorched;
        (paper + (CHAR[k] - paper) * charred).round() as u8
    })
}

/// How dark a node has become: 0 white paper, one half scorched brown, 1 char.
pub fn darkness(peak_temperature: f64, charred: f64) -> f64 {
    let brown = 0.5 * scorched(peak_temperature);
    brown + (1.0 - brown) * charred.clamp(0.0, 1.0)
}

fn scorched(peak_temperature: f64) -> f64 {
    ((peak_temperature - SCORCH[0]) / (SCORCH[1] - SCORCH[0])).clamp(0.0, 1.0)
}

/// Linear value, 0 to 1, of an sRGB component. IEC 61966-2-1, its transfer function.
pub fn linear(component: u8) -> f32 {
    let value = f64::from(component) / 255.0;
    let linear = if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) };
    linear as f32
}
