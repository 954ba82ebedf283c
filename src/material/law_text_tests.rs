use super::*;
use crate::math::mandel::Mandel;

fn read(text: &str) -> Result<Law, LawTextError> {
    toml::from_str::<LawText>(text).unwrap().law()
}

const STRAIN: Mandel = Mandel::new(0.1, -0.05, -0.1, 0.02, 0.03, -0.04);

#[test]
fn the_same_material_in_several_words() {
    let linear = read("id = \"a\"\nyoung = \"0.3 MPa\"\npoisson = 0.25").unwrap();
    assert_eq!(linear, Law::linear_isotropic(0.3, 0.25).unwrap());
    // E = 0.3, ν = 0.25: μ = 0.12, K = 0.2, λ = 0.12, C10 = 0.06, D1 = 10.
    for form in ["logarithmic", "isochoric"] {
        let pairs = [
            "young = \"300 kPa\"\npoisson = 0.25",
            "shear = \"0.12 MPa\"\nbulk = \"0.2 MPa\"",
            "shear = \"0.12 MPa\"\nlame_lambda = \"0.12 MPa\"",
            "c10 = \"0.06 MPa\"\nd1 = \"10 1/MPa\"",
            "shear = \"0.12 MPa\"\npoisson = 0.25",
        ];
        let laws = pairs.map(|p| read(&format!("law = \"neo-hookean\"\nform = \"{form}\"\n{p}")).unwrap());
        for law in &laws {
            let gap = (law.stress(&STRAIN) - laws[0].stress(&STRAIN)).norm();
            assert!(gap < 1e-15, "{gap:e}");
        }
    }
}

#[test]
fn ogdens_conventions_and_mooney_rivlin_agree() {
    // Mooney–Rivlin C10 = 0.1, C01 = 0.02 is Ogden with μ = 0.2, α = 2 and μ = 0.04, α = −2; FEBio's c = 2μ; Ogden's own
    // μ α/2: 0.2 and −0.04.
    let mooney =
        read("law = \"mooney-rivlin\"\nc10 = \"0.1 MPa\"\nc01 = \"0.02 MPa\"\nbulk = \"2 MPa\"").unwrap();
    for (convention, a, b) in [
        ("abaqus", 0.2, 0.04),
        ("febio", 0.4, 0.08),
        ("classic", 0.2, -0.04),
    ] {
        let law = read(&format!(
            "law = \"ogden\"\nconvention = \"{convention}\"\nvolume = \"powers\"\nd = [\"1 1/MPa\"]\n\
             terms = [{{ shear = \"{a} MPa\", exponent = 2.0 }}, {{ shear = \"{b} MPa\", exponent = -2.0 }}]"
        ))
        .unwrap();
        assert!(
            (law.stress(&STRAIN) - mooney.stress(&STRAIN)).norm() < 1e-14,
            "{convention}"
        );
    }
    let foam = "law = \"hyperfoam\"\npoisson = 0.1\nterms = [{ shear = \"0.2 MPa\", exponent = 4.0 }]";
    assert!((read(foam).unwrap().poisson_ratio_at_rest() - 0.1).abs() < 1e-15);
}

#[test]
fn interpolated_laws() {
    let centres = "centres = [{ strain = [0, 0, 0, 0, 0, 0], moduli = [\"0.2 MPa\", \"0.5 MPa\"] }, \
                   { strain = [0.1, 0.1, -0.3, 0, 0, 0], moduli = [\"0.4 MPa\", \"0.9 MPa\"] }]";
    let secant = read(&format!("law = \"rbf\"\nform = \"secant\"\n{centres}")).unwrap();
    let strain = Mandel::new(0.1, 0.1, -0.3, 0.0, 0.0, 0.0);
    // T_zz = 2μ dev_zz + K tr with μ = 0.4, K = 0.9: dev_zz = −0.8/3, tr = −0.1.
    assert!((secant.stress(&strain)[2] + 0.8 * 0.8 / 3.0 + 0.09).abs() < 1e-14);
    assert!(secant.in_range(&(strain * 0.999)) && !secant.in_range(&(strain * 1.1)));
    let energy = read(&format!("law = \"rbf\"\nform = \"energy\"\n{centres}")).unwrap();
    assert!(energy.energy(&strain).is_some());
    let paper = "law = \"rbf\"\nform = \"paper\"\nnorm = \"tensor\"\nconstant = false\nconvention = \"young-poisson\"\n\
                 centres = [{ strain = [0, 0, 0, 0, 0, 0], moduli = [\"0.2 MPa\", \"0.3\"] }, \
                 { strain = [0.1, 0.1, -0.3, 0, 0, 0], moduli = [\"0.4 MPa\", \"0.4\"] }]";
    let paper = read(paper).unwrap();
    assert!((paper.young_modulus(&strain) - 0.4).abs() < 1e-14);
    let five = "law = \"rbf\"\nform = \"secant\"\naxis = [1, 0, 0]\ncentres = [{ invariants = [0, 0, 0, 0], \
                moduli = [\"0.1 MPa\", \"0.04 MPa\", \"0.03 MPa\", \"0.4 MPa\", \"0.08 MPa\"] }]";
    let five = read(five).unwrap();
    // Along the axis: E33 − 2 E13²/(E11 + E12).
    assert!((five.young_modulus(&Mandel::zeros()) - (0.4 - 2.0 * 0.03 * 0.03 / 0.14)).abs() < 1e-14);
}

#[test]
fn mistakes_name_the_field_and_its_place() {
    let text = "law = \"neo-hookean\"\nform = \"isochoric\"\nyoung = \"0.3\"\npoisson = 0.4";
    let error = read(text).unwrap_err();
    assert_eq!(error.field, "young");
    assert_eq!(&text[error.span.unwrap()], "\"0.3\"");
    for (text, field, part) in [
        ("law = \"rubber\"", "law", "neo-hookean"),
        ("young = \"1 MPa\"", "poisson", "missing"),
        ("young = \"1 MPa\"\npoisson = 0.5", "poisson", "below 0.5"),
        (
            "young = \"1 MPa\"\npoisson = 0.3\nc10 = \"1 MPa\"",
            "c10",
            "no field",
        ),
        (
            "law = \"neo-hookean\"\nshear = \"1 MPa\"\nbulk = \"1 MPa\"",
            "form",
            "logarithmic or isochoric",
        ),
        (
            "law = \"mooney-rivlin\"\nc10 = \"1 MPa\"\nc01 = \"0 MPa\"\nd1 = \"0 1/MPa\"",
            "d1",
            "positive",
        ),
        ("law = \"ogden\"\nbulk = \"1 MPa\"", "terms", "missing"),
        (
            "law = \"ogden\"\nbulk = \"1 MPa\"\nterms = [{ shear = \"1 MPa\", exponent = 0.0 }]",
            "terms[0].exponent",
            "not 0",
        ),
        ("law = \"rbf\"\nform = \"secant\"", "centres", "missing"),
        (
            "law = \"rbf\"\nform = \"energy\"\ncentres = [{ strain = [0,0,0,0,0,0], moduli = [\"1 MPa\"] }]",
            "centres[0].moduli",
            "found 1 moduli",
        ),
    ] {
        let error = read(text).unwrap_err();
        assert_eq!(error.field, field, "{error}");
        assert!(error.message.contains(part), "{error}");
    }
}
