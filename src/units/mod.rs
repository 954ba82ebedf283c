//! Quantities at the borders. Inside, everything is in N, mm and MPa.
