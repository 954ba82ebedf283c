//! Colours: sRGB bytes at the borders, Oklab where lightness and hue matter.
//!
//! Oklab (B. Ottosson, 2020) is a colour space where equal distances look about equally different:
//!
//! ```text
//! (l, m, s) = M₁ · linear sRGB,    (L, a, b) = M₂ · (∛l, ∛m, ∛s),    L ∈ [0, 1] lightness
//! ```
//!
//! The sequential map walks through it at constant steps of lightness from dark violet to light yellow, with the same
//! chroma throughout as far as an sRGB screen can show it. So it orders values for every reader, and in grey print too.

use std::sync::OnceLock;

/// An opaque colour, sRGB, 8 bits each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Colour {
    /// Red, 0 to 255.
    pub red: u8,
    /// Green, 0 to 255.
    pub green: u8,
    /// Blue, 0 to 255.
    pub blue: u8,
}

/// Eight colours that people with colour blindness tell apart (Okabe and Ito, 2008), black first.
pub const QUALITATIVE: [Colour; 8] = [
    Colour::rgb(0x00, 0x00, 0x00),
    Colour::rgb(0x00, 0x72, 0xb2),
    Colour::rgb(0xd5, 0x5e, 0x00),
    Colour::rgb(0x00, 0x9e, 0x73),
    Colour::rgb(0xcc, 0x79, 0xa7),
    Colour::rgb(0xe6, 0x9f, 0x00),
    Colour::rgb(0x56, 0xb4, 0xe9),
    Colour::rgb(0xf0, 0xe4, 0x42),
];

/// What is drawn where no value is known.
pub const NO_VALUE: Colour = Colour::rgb(0xb8, 0xb8, 0xb8);

impl Colour {
    /// From sRGB bytes.
    pub const fn rgb(red: u8, green: u8, blue: u8) -> Self {
        Self { red, green, blue }
    }

    /// Reads `#rrggbb` or `#rrggbbaa` (the opacity is dropped), with or without the `#`; `None` for anything else.
    pub fn from_hex(text: &str) -> Option<Self> {
        let digits = text.trim().trim_start_matches('#');
        if !matches!(digits.len(), 6 | 8) || !digits.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            return None;
        }
        let byte = |at: usize| u8::from_str_radix(&digits[at..at + 2], 16).ok();
        Some(Self::rgb(byte(0)?, byte(2)?, byte(4)?))
    }

    /// The nth colour of [`QUALITATIVE`], starting over after the last.
    pub fn qualitative(index: usize) -> Self {
        QUALITATIVE[index % QUALITATIVE.len()]
    }

    /// `#rrggbb`.
    pub fn hex(self) -> String {
        format!("#{:02x}{:02x}{:02x}", self.red, self.green, self.blue)
    }

    /// Perceived lightness, 0 black to 1 white (Oklab L).
    pub fn lightness(self) -> f64 {
        self.oklab()[0]
    }

    /// The same hue, darkened until a thin line of it can be seen on white paper.
    pub fn on_white(self) -> Self {
        let [lightness, a, b] = self.oklab();
        // 0.72 is about the lightness of Okabe and Ito's orange, the lightest of theirs that reads as a thin line.
        if lightness <= 0.72 {
            self
        } else {
            from_oklab([0.72, a, b])
        }
    }

    /// Linear light of the three channels, 0 to 1.
    pub fn linear(self) -> [f64; 3] {
        [self.red, self.green, self.blue].map(|byte| decode(f64::from(byte) / 255.0))
    }

    /// From linear light, clamped to 0 to 1.
    pub fn from_linear(linear: [f64; 3]) -> Self {
        let [red, green, blue] = linear.map(|light| (encode(light.clamp(0.0, 1.0)) * 255.0).round() as u8);
        Self { red, green, blue }
    }

    fn oklab(self) -> [f64; 3] {
        let [r, g, b] = self.linear();
        let l = (0.412_221_470_8 * r + 0.536_332_536_3 * g + 0.051_445_992_9 * b).cbrt();
        let m = (0.211_903_498_2 * r + 0.680_699_545_1 * g + 0.107_396_956_6 * b).cbrt();
        let s = (0.088_302_461_9 * r + 0.281_718_837_6 * g + 0.629_978_700_5 * b).cbrt();
        [
            0.210_454_255_3 * l + 0.793_617_785_0 * m - 0.004_072_046_8 * s,
            1.977_998_495_1 * l - 2.428_592_205_0 * m + 0.450_593_709_9 * s,
            0.025_904_037_1 * l + 0.782_771_766_2 * m - 0.808_675_766_0 * s,
        ]
    }
}

/// The colour of a fraction, 0 to 1, on the sequential map. Values outside are clamped; [`NO_VALUE`] for NaN.
pub fn sequential(fraction: f64) -> Colour {
    static MAP: OnceLock<Vec<Colour>> = OnceLock::new();
    if fraction.is_nan() {
        return NO_VALUE;
    }
    let map = MAP.get_or_init(|| {
        (0..=255)
            .map(|step| sequential_exact(f64::from(step) / 255.0))
            .collect()
    });
    map[(fraction.clamp(0.0, 1.0) * 255.0).round() as usize]
}

fn sequential_exact(fraction: f64) -> Colour {
    let lightness = 0.30 + 0.62 * fraction;
    // 300° violet, 250° blue, 195° blue-green, 145° green, 105° yellow.
    let hue = (300.0 - 195.0 * fraction).to_radians();
    // Thirty halvings of the largest chroma that stays on the screen: far below one byte's step.
    let (mut inside, mut outside) = (0.0, 0.125);
    for _ in 0..30 {
        let chroma = 0.5 * (inside + outside);
        let shown = linear_from_oklab([lightness, chroma * hue.cos(), chroma * hue.sin()]);
        if shown.iter().all(|light| (0.0..=1.0).contains(light)) {
            inside = chroma;
        } else {
            outside = chroma;
        }
    }
    from_oklab([lightness, inside * hue.cos(), inside * hue.sin()])
}

fn from_oklab(oklab: [f64; 3]) -> Colour {
    Colour::from_linear(linear_from_oklab(oklab))
}

fn linear_from_oklab([lightness, a, b]: [f64; 3]) -> [f64; 3] {
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
    ]
}

/// sRGB transfer function, encoded to linear (IEC 61966-2-1).
fn decode(value: f64) -> f64 {
    if value <= 0.040_45 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}

fn encode(light: f64) -> f64 {
    if light <= 0.003_130_8 {
        light * 12.92
    } else {
        1.055 * light.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hex_goes_there_and_back() {
        assert_eq!(
            Colour::from_hex("#0072b2").map(Colour::hex).as_deref(),
            Some("#0072b2")
        );
        assert_eq!(Colour::from_hex("E69F00FF"), Some(Colour::rgb(0xe6, 0x9f, 0x00)));
        for wrong in ["", "#12345", "#12345g", "red", "#äöü"] {
            assert_eq!(Colour::from_hex(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn linear_light_goes_there_and_back() {
        for byte in 0..=255u8 {
            let grey = Colour::rgb(byte, byte, byte);
            assert_eq!(Colour::from_linear(grey.linear()), grey);
        }
    }

    #[test]
    fn oklab_of_known_colours() {
        // Ottosson's definition makes white L = 1 and black L = 0; red is L = 0.62796, the value of CSS Color 4.
        assert!((Colour::rgb(255, 255, 255).lightness() - 1.0).abs() < 1e-6);
        assert!(Colour::rgb(0, 0, 0).lightness().abs() < 1e-12);
        assert!((Colour::rgb(255, 0, 0).lightness() - 0.627_96).abs() < 1e-4);
    }

    #[test]
    fn the_map_gets_lighter_all_the_way() {
        let lightness: Vec<f64> = (0..=64)
            .map(|step| sequential(f64::from(step) / 64.0).lightness())
            .collect();
        for pair in lightness.windows(2) {
            // Equal steps of 0.62/64 = 0.0097, but for rounding to 256 colours and to bytes.
            assert!((pair[1] - pair[0] - 0.62 / 64.0).abs() < 0.005, "{pair:?}");
        }
        assert_eq!(sequential(-3.0), sequential(0.0));
        assert_eq!(sequential(f64::INFINITY), sequential(1.0));
        assert_eq!(sequential(f64::NAN), NO_VALUE);
    }

    #[test]
    fn light_colours_are_darkened_for_lines() {
        let yellow = Colour::rgb(255, 250, 160);
        assert!(yellow.on_white().lightness() < 0.75);
        assert_eq!(QUALITATIVE[1].on_white(), QUALITATIVE[1]);
    }
}
