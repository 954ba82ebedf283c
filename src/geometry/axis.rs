//! The three axes of space and the cyclic order of the other two.

use crate::math::Vec3;
use serde::{Deserialize, Serialize};

/// A coordinate axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    X,
    Y,
    Z,
}

impl Axis {
    /// The three axes in order.
    pub const ALL: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];

    /// 0, 1 or 2.
    pub const fn index(self) -> usize {
        self as usize
    }

    /// The indices of the two other axes in cyclic order: x → (y, z), y → (z, x), z → (x, y).
    pub const fn others(self) -> (usize, usize) {
        match self {
            Axis::X => (1, 2),
            Axis::Y => (2, 0),
            Axis::Z => (0, 1),
        }
    }

    /// The point at `along` on the line parallel to this axis through (a, b), the two other coordinates in cyclic order.
    pub fn point(self, along: f64, a: f64, b: f64) -> Vec3 {
        let (i, j) = self.others();
        let mut point = Vec3::zeros();
        point[self.index()] = along;
        point[i] = a;
        point[j] = b;
        point
    }
}

impl std::str::FromStr for Axis {
    type Err = String;

    /// Reads `x`, `y` or `z`, small or capital.
    ///
    /// # Errors
    /// A sentence that names what was found.
    fn from_str(text: &str) -> Result<Axis, String> {
        match text.trim() {
            "x" | "X" => Ok(Axis::X),
            "y" | "Y" => Ok(Axis::Y),
            "z" | "Z" => Ok(Axis::Z),
            other => Err(format!("\"{other}\" is no axis: expected x, y or z")),
        }
    }
}

impl std::fmt::Display for Axis {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(["x", "y", "z"][self.index()])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_other_axes_follow_in_cyclic_order() {
        // e_i × e_j = e_axis is what "cyclic order" means.
        for axis in Axis::ALL {
            let (i, j) = axis.others();
            let unit = |k: usize| Vec3::ith(k, 1.0);
            assert_eq!(unit(i).cross(&unit(j)), unit(axis.index()));
            let point = axis.point(1.0, 2.0, 3.0);
            assert_eq!((point[axis.index()], point[i], point[j]), (1.0, 2.0, 3.0));
        }
    }

    #[test]
    fn records_hold_the_letter() {
        assert_eq!(serde_json::to_string(&Axis::Y).unwrap(), "\"y\"");
        assert_eq!(serde_json::from_str::<Axis>("\"z\"").unwrap(), Axis::Z);
        assert!("w".parse::<Axis>().is_err());
    }
}
