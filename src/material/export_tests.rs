use super::*;
use crate::material::homogeneous::uniaxial;
use crate::material::hyperelastic::Hyperelastic;
use crate::material::law::Law;

fn material(form: Form) -> ExportedMaterial {
    ExportedMaterial {
        id: "soft-one".into(),
        density_g_per_cm3: 1.07,
        remarks: vec!["from a test -- of course".into()],
        form,
    }
}

fn foam(terms: &[(f64, f64, f64)]) -> Form {
    let term = |&(shear_mpa, exponent, poisson): &(f64, f64, f64)| FoamTerm {
        shear_mpa,
        exponent,
        poisson,
    };
    Form::Hyperfoam {
        terms: terms.iter().map(term).collect(),
    }
}

fn ogden(terms: &[(f64, f64)], volume: VolumeEnergy) -> Form {
    let term = |&(shear_mpa, exponent): &(f64, f64)| OgdenTerm { shear_mpa, exponent };
    Form::Ogden {
        terms: terms.iter().map(term).collect(),
        volume,
    }
}

/// Lines after `*MATERIAL`, without the density.
fn law_lines(form: &Form, program: Program) -> String {
    let text = material(form.clone()).text(program).unwrap();
    let start = text.find("NAME=M_SOFT_ONE\n").unwrap() + "NAME=M_SOFT_ONE\n".len();
    text[start..text.find("*DENSITY").unwrap()].to_string()
}

/// A unit cube pressed by 30 % with free sides: reaction [N] and sideways displacement [mm] that CalculiX 2.20 printed
/// for these very lines (one C3D8, seven digits), beside what the law itself answers.
#[test]
fn calculix_reads_the_law_as_it_is() {
    let powers = |list: &[f64]| VolumeEnergy::Powers(list.to_vec());
    let cases = [
        (
            Form::NeoHookeanIsochoric {
                shear_mpa: 0.1,
                bulk_mpa: 20.0,
            },
            "*HYPERELASTIC, NEO HOOKE\n0.05, 0.1\n",
            -0.133_902_04,
            0.194_293_2,
        ),
        (
            Form::MooneyRivlin {
                c10_mpa: 0.05,
                c01_mpa: 0.02,
                bulk_mpa: 20.0,
            },
            "*HYPERELASTIC, MOONEY-RIVLIN\n0.05, 0.02, 0.1\n",
            -0.210_193_36,
            0.193_758_6,
        ),
        (
            ogden(&[(0.1, 1.5)], powers(&[10.0])),
            "*HYPERELASTIC, OGDEN, N=1\n0.1, 1.5, 0.1\n",
            -0.137_151_6,
            0.194_270_4,
        ),
        (
            ogden(&[(0.1, 1.5), (0.05, -2.0)], powers(&[10.0])),
            "*HYPERELASTIC, OGDEN, N=2\n0.1, 1.5, 0.05, -2.0, 0.1, 0.0\n",
            -0.232_482_24,
            0.193_602_2,
        ),
        (
            ogden(
                &[(0.1, 1.5), (0.05, -2.0), (0.02, 5.0)],
                powers(&[10.0, 4.0, 2.0]),
            ),
            "*HYPERELASTIC, OGDEN, N=3\n0.1, 1.5, 0.05, -2.0, 0.02, 5.0, 0.1, 0.25\n0.5\n",
            -0.258_288_2,
            0.193_421,
        ),
        (
            foam(&[(0.1, 4.0, 0.1)]),
            "*HYPERFOAM, N=2\n0.1, 4.0, 0.0, 2.0, 0.1, 0.1\n",
            -0.065_232_08,
            0.036_311_21,
        ),
        (
            foam(&[(0.1, 4.0, 0.1), (0.05, -2.0, 0.3), (0.03, 8.0, 0.2)]),
            "*HYPERFOAM, N=3\n0.1, 4.0, 0.05, -2.0, 0.03, 8.0, 0.1, 0.3\n0.2\n",
            -0.176_488_92,
            0.068_067_28,
        ),
    ];
    for (form, lines, force, sideways) in cases {
        assert_eq!(law_lines(&form, Program::Calculix), lines);
        let law = Law::Hyperelastic(Hyperelastic::new(form).unwrap());
        let state = uniaxial(&law, -0.3);
        // Newton's tolerance there, and seven digits printed.
        assert!(
            (state.stress / force - 1.0).abs() < 2e-6,
            "{lines}: {}",
            state.stress
        );
        assert!(
            (state.lateral - sideways).abs() < 1e-6,
            "{lines}: {}",
            state.lateral
        );
    }
}

#[test]
fn abaqus_takes_a_foam_of_one_term() {
    let lines = law_lines(&foam(&[(0.1, 4.0, 0.1)]), Program::Abaqus);
    assert_eq!(lines, "*HYPERFOAM, N=1\n0.1, 4.0, 0.1\n");
    let plain = Form::NeoHookeanLogarithmic {
        shear_mpa: 0.1,
        lame_lambda_mpa: 0.0,
    };
    assert_eq!(
        law_lines(&plain, Program::Abaqus),
        "*HYPERFOAM, N=1\n0.1, 2.0, 0.0\n"
    );
    let text = material(plain).text(Program::Abaqus).unwrap();
    assert!(text.ends_with("*DENSITY\n1.07e-9\n"), "{text}");
    assert!(
        text.lines()
            .all(|l| l.starts_with('*') || l.starts_with(|c: char| c.is_ascii_digit())),
        "{text}"
    );
}

/// Parameters read back from the XML by their tags.
fn febio(form: Form) -> (String, Vec<(String, f64)>) {
    use quick_xml::events::Event;
    let text = material(form).text(Program::Febio).unwrap();
    let mut reader = quick_xml::Reader::from_str(&text);
    let (mut kind, mut values, mut open) = (String::new(), Vec::new(), Vec::new());
    loop {
        match reader.read_event().unwrap() {
            Event::Start(start) => {
                let name = start.name().as_ref().to_string();
                if name == "material" {
                    let attribute = start.try_get_attribute("type").unwrap().unwrap();
                    kind = attribute.value.into_owned();
                }
                open.push(name);
            }
            Event::Text(t) if open.len() == 4 => {
                let text: &str = &t;
                if let Ok(value) = text.trim().parse() {
                    values.push((open[3].clone(), value));
                }
            }
            Event::End(_) => {
                open.pop();
            }
            Event::Eof => break,
            _ => {}
        }
    }
    assert!(open.is_empty(), "{text}");
    (kind, values)
}

#[test]
fn febio_reads_back() {
    let named = |list: &[(&str, f64)]| -> Vec<(String, f64)> {
        list.iter().map(|(n, v)| (n.to_string(), *v)).collect()
    };
    let rubber = Form::MooneyRivlin {
        c10_mpa: 0.05,
        c01_mpa: 0.02,
        bulk_mpa: 20.0,
    };
    let expected = [
        ("density", 1.07e-9),
        ("c1", 0.05),
        ("c2", 0.02),
        ("k", 20.0),
        ("pressure_model", 2.0),
    ];
    assert_eq!(febio(rubber), ("Mooney-Rivlin".into(), named(&expected)));
    let (kind, values) = febio(ogden(&[(0.1, 1.5), (0.05, -2.0)], VolumeEnergy::Logarithm(5.0)));
    let expected = [
        ("density", 1.07e-9),
        ("c1", 0.2),
        ("m1", 1.5),
        ("c2", 0.1),
        ("m2", -2.0),
        ("k", 5.0),
        ("pressure_model", 0.0),
    ];
    assert_eq!((kind.as_str(), values), ("Ogden", named(&expected)));
    let (kind, values) = febio(foam(&[(0.1, 4.0, 0.0)]));
    let expected = [("density", 1.07e-9), ("c1", 0.2), ("m1", 4.0), ("cp", 0.0)];
    assert_eq!((kind.as_str(), values), ("Ogden unconstrained", named(&expected)));
    // λ = 2μν/(1 − 2ν) with E = 2μ(1 + ν): ν = 0.25 where λ = μ.
    let plain = Form::NeoHookeanLogarithmic {
        shear_mpa: 0.4,
        lame_lambda_mpa: 0.4,
    };
    let (kind, values) = febio(plain);
    assert_eq!(kind, "neo-Hookean");
    assert!(
        (values[1].1 - 1.0).abs() < 1e-15 && (values[2].1 - 0.25).abs() < 1e-15,
        "{values:?}"
    );
}

/// The initial moduli of what FEBio is told are the law's own: μ = Σ c_k/2 and K of the volume's energy.
#[test]
fn febio_has_the_laws_moduli() {
    let law = Hyperelastic::new(ogden(
        &[(0.1, 1.5), (0.05, -2.0)],
        VolumeEnergy::Powers(vec![10.0]),
    ))
    .unwrap();
    let (_, values) = febio(law.form().clone());
    let of = |name: &str| values.iter().find(|v| v.0 == name).unwrap().1;
    let (shear, bulk) = law.moduli_at_rest();
    assert!((0.5 * (of("c1") + of("c2")) - shear).abs() < 1e-15);
    assert_eq!(of("k"), bulk);
}

#[test]
fn what_a_program_lacks_is_refused() {
    let refuse = |form: Form, program: Program, why: &str| {
        let error = material(form).text(program).unwrap_err().to_string();
        assert!(error.contains(program.name()) && error.contains(why), "{error}");
    };
    let four = [(0.1, 1.0), (0.1, 2.0), (0.1, 3.0), (0.1, 4.0)];
    refuse(
        ogden(&four, VolumeEnergy::Powers(vec![1.0])),
        Program::Calculix,
        "3 terms",
    );
    assert!(
        material(ogden(&four, VolumeEnergy::Powers(vec![1.0])))
            .text(Program::Abaqus)
            .is_ok()
    );
    refuse(
        ogden(&four, VolumeEnergy::Logarithm(1.0)),
        Program::Abaqus,
        "ln J",
    );
    refuse(
        ogden(&four, VolumeEnergy::Powers(vec![1.0, 2.0])),
        Program::Febio,
        "higher powers",
    );
    refuse(foam(&[(0.1, 4.0, 0.1)]), Program::Febio, "Poisson");
    let plain = Form::NeoHookeanLogarithmic {
        shear_mpa: 0.4,
        lame_lambda_mpa: 0.4,
    };
    refuse(plain, Program::Abaqus, "powers of J");
}
