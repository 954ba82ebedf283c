//! A hyperelastic law as other programs read it: FEBio, CalculiX, Abaqus.
//!
//! | law | Abaqus, CalculiX | FEBio |
//! |---|---|---|
//! | neo-Hooke, isochoric | `*HYPERELASTIC, NEO HOOKE`: C10 = μ/2, D1 = 2/K | `Mooney-Rivlin`: c1 = μ/2, c2 = 0, k = K |
//! | Mooney–Rivlin | `*HYPERELASTIC, MOONEY-RIVLIN`: C10, C01, D1 = 2/K | `Mooney-Rivlin`: c1, c2, k |
//! | Ogden, U = Σ c_k (J − 1)^2k | `*HYPERELASTIC, OGDEN`: μ_k, α_k, D_k = 1/c_k | `Ogden`: c_k = 2μ_k, m_k = α_k, k = 2c_1; one c alone |
//! | Ogden, U = K/2 (ln J)² | – | `Ogden`, k = K |
//! | hyperfoam | `*HYPERFOAM`: μ_k, α_k, ν_k | `Ogden unconstrained`: c_k = 2μ_k, m_k = α_k, cp = 0; all ν_k = 0 |
//! | neo-Hooke, logarithmic | `*HYPERFOAM` with α = 2, ν = 0, if λ = 0 | `neo-Hookean`: E and v of λ and μ |
//!
//! FEBio's pressure model 2 is U = K/2 (J − 1)², its default 0 U = K/2 (ln J)². Units are N, mm, MPa and t/mm³ throughout.
//!
//! Valid where the energies are the same function; [`ExportError`] for everything else, never something near. Sources:
//! Abaqus Theory Guide 4.6.1, 4.6.2; CalculiX 2.20, whose answers to these lines were compared with the law's own (it fails
//! on a hyperfoam of one term, which is therefore written with a second one of zero); FEBio's `FEUncoupledMaterial.h`,
//! `FEOgdenMaterial`, `FEOgdenUnconstrained`, `FENeoHookean`.

use super::hyperelastic::{FoamTerm, Form, OgdenTerm, VolumeEnergy};

/// A program that reads materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Program {
    /// FEBio 3 and later, XML.
    Febio,
    /// CalculiX, keywords.
    Calculix,
    /// Abaqus, keywords.
    Abaqus,
}

impl Program {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Program::Febio => "FEBio",
            Program::Calculix => "CalculiX",
            Program::Abaqus => "Abaqus",
        }
    }

    /// The most terms of a sum that it reads.
    fn most_terms(self) -> usize {
        match self {
            Program::Calculix => 3,
            Program::Febio | Program::Abaqus => 6,
        }
    }
}

/// Why a program can't have a law.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{program} can't express {law}: {reason}")]
pub struct ExportError {
    /// The program.
    pub program: &'static str,
    /// The law.
    pub law: &'static str,
    /// What is missing.
    pub reason: String,
}

/// A material as it goes to another program.
#[derive(Clone, Debug, PartialEq)]
pub struct ExportedMaterial {
    /// The id, which names the material.
    pub id: String,
    /// Density \[g/cm³\].
    pub density_g_per_cm3: f64,
    /// Lines of comment: where it comes from, how near it is.
    pub remarks: Vec<String>,
    /// The energy.
    pub form: Form,
}

impl ExportedMaterial {
    /// The text of the material for `program`.
    ///
    /// # Errors
    /// An energy that the program does not have.
    pub fn text(&self, program: Program) -> Result<String, ExportError> {
        match program {
            Program::Febio => self.xml(),
            Program::Calculix | Program::Abaqus => self.keywords(program),
        }
    }

    fn keywords(&self, program: Program) -> Result<String, ExportError> {
        let (keyword, numbers) = keyword_law(&self.form, program)?;
        let mut text = String::new();
        for remark in &self.remarks {
            text.push_str(&format!("** {}\n", one_line(remark)));
        }
        text.push_str("** units: N, mm, MPa, t/mm^3\n");
        text.push_str(&format!(
            "*MATERIAL, NAME={}\n{keyword}\n",
            keyword_name(&self.id)
        ));
        for line in numbers.chunks(8) {
            let line: Vec<String> = line.iter().map(|x| number(*x)).collect();
            text.push_str(&format!("{}\n", line.join(", ")));
        }
        text.push_str(&format!("*DENSITY\n{}\n", number(self.density())));
        Ok(text)
    }

    fn xml(&self) -> Result<String, ExportError> {
        let (kind, numbers) = febio_law(&self.form)?;
        let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
        for remark in self
            .remarks
            .iter()
            .map(String::as_str)
            .chain(["units: N, mm, MPa, t/mm^3"])
        {
            // Two hyphens may not stand in an XML comment, nor one at its end.
            text.push_str(&format!(
                "<!-- {} -->\n",
                one_line(remark).replace('-', "\u{2010}")
            ));
        }
        text.push_str("<febio_spec version=\"4.0\">\n  <Material>\n");
        text.push_str(&format!(
            "    <material id=\"1\" name=\"{}\" type=\"{kind}\">\n",
            plain(&self.id)
        ));
        text.push_str(&format!("      <density>{}</density>\n", number(self.density())));
        for (name, value) in numbers {
            text.push_str(&format!("      <{name}>{value}</{name}>\n"));
        }
        text.push_str("    </material>\n  </Material>\n</febio_spec>\n");
        Ok(text)
    }

    /// In t/mm³.
    fn density(&self) -> f64 {
        super::record::significant(1e-9 * self.density_g_per_cm3, 12)
    }
}

fn one_line(text: &str) -> String {
    text.chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .collect()
}

/// A name of letters, digits and hyphens, whatever an unsound record says.
fn plain(id: &str) -> String {
    id.chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect()
}

/// Keyword names are in capitals and begin with a letter.
fn keyword_name(id: &str) -> String {
    format!("M_{}", plain(id).to_uppercase().replace('-', "_"))
}

/// The shortest text that reads as the same number, with a point or an exponent as keywords want.
fn number(x: f64) -> String {
    match x == 0.0 || (1e-4..1e6).contains(&x.abs()) {
        true => format!("{x:?}"),
        false => format!("{x:e}"),
    }
}

fn refused(program: Program, law: &'static str, reason: impl Into<String>) -> ExportError {
    ExportError {
        program: program.name(),
        law,
        reason: reason.into(),
    }
}

fn check_terms(program: Program, law: &'static str, terms: usize) -> Result<(), ExportError> {
    let most = program.most_terms();
    match terms > most {
        true => Err(refused(
            program,
            law,
            format!("it reads {most} terms, the law has {terms}"),
        )),
        false => Ok(()),
    }
}

/// The keyword line and the numbers below it.
fn keyword_law(form: &Form, program: Program) -> Result<(String, Vec<f64>), ExportError> {
    match form {
        Form::NeoHookeanIsochoric { shear_mpa, bulk_mpa } => Ok((
            "*HYPERELASTIC, NEO HOOKE".into(),
            vec![0.5 * shear_mpa, 2.0 / bulk_mpa],
        )),
        Form::MooneyRivlin {
            c10_mpa,
            c01_mpa,
            bulk_mpa,
        } => Ok((
            "*HYPERELASTIC, MOONEY-RIVLIN".into(),
            vec![*c10_mpa, *c01_mpa, 2.0 / bulk_mpa],
        )),
        Form::Ogden {
            terms,
            volume: VolumeEnergy::Powers(powers),
        } => ogden_keyword(terms, powers, program),
        Form::Ogden { .. } => Err(refused(
            program,
            "Ogden's law with U = K/2 (ln J)²",
            "its U is a sum of powers of J − 1",
        )),
        Form::Hyperfoam { terms } => foam_keyword(terms, program),
        Form::NeoHookeanLogarithmic {
            shear_mpa,
            lame_lambda_mpa,
        } if *lame_lambda_mpa == 0.0 => {
            let term = FoamTerm {
                shear_mpa: *shear_mpa,
                exponent: 2.0,
                poisson: 0.0,
            };
            foam_keyword(&[term], program)
        }
        Form::NeoHookeanLogarithmic { .. } => Err(refused(
            program,
            "the neo-Hookean law with λ/2 (ln J)²",
            "its energies of volume are powers of J − 1",
        )),
    }
}

fn ogden_keyword(
    terms: &[OgdenTerm],
    powers: &[f64],
    program: Program,
) -> Result<(String, Vec<f64>), ExportError> {
    const LAW: &str = "Ogden's law";
    // As many D as terms: terms of zero make room for more powers.
    let count = terms.len().max(powers.len());
    check_terms(program, LAW, count)?;
    if powers.first().is_none_or(|c| *c == 0.0) || powers.iter().any(|c| !c.is_finite()) {
        return Err(refused(program, LAW, "D1 would be infinite"));
    }
    let mut numbers = Vec::new();
    for k in 0..count {
        let none = OgdenTerm {
            shear_mpa: 0.0,
            exponent: 2.0,
        };
        let term = terms.get(k).unwrap_or(&none);
        numbers.extend([term.shear_mpa, term.exponent]);
    }
    for k in 0..count {
        // A D of zero means that there is no such term.
        let power = powers.get(k).copied().unwrap_or(0.0);
        numbers.push(if power == 0.0 { 0.0 } else { 1.0 / power });
    }
    Ok((format!("*HYPERELASTIC, OGDEN, N={count}"), numbers))
}

fn foam_keyword(terms: &[FoamTerm], program: Program) -> Result<(String, Vec<f64>), ExportError> {
    check_terms(program, "the hyperfoam law", terms.len())?;
    let mut terms = terms.to_vec();
    if let ([only], Program::Calculix) = (terms.as_slice(), program) {
        let nothing = FoamTerm {
            shear_mpa: 0.0,
            exponent: 2.0,
            poisson: only.poisson,
        };
        terms.push(nothing);
    }
    let mut numbers: Vec<f64> = terms.iter().flat_map(|t| [t.shear_mpa, t.exponent]).collect();
    numbers.extend(terms.iter().map(|t| t.poisson));
    Ok((format!("*HYPERFOAM, N={}", terms.len()), numbers))
}

type Tags = Vec<(String, String)>;

/// FEBio's type and its parameters.
fn febio_law(form: &Form) -> Result<(&'static str, Tags), ExportError> {
    let program = Program::Febio;
    let tag = |name: &str, value: f64| (name.to_string(), number(value));
    let pressure = |model: u8| ("pressure_model".to_string(), model.to_string());
    let sum = |terms: &[(f64, f64)]| -> Tags {
        let mut tags = Vec::new();
        for (k, (shear, exponent)) in terms.iter().enumerate() {
            tags.push(tag(&format!("c{}", k + 1), 2.0 * shear));
            tags.push(tag(&format!("m{}", k + 1), *exponent));
        }
        tags
    };
    match form {
        Form::NeoHookeanIsochoric { shear_mpa, bulk_mpa } => Ok((
            "Mooney-Rivlin",
            vec![
                tag("c1", 0.5 * shear_mpa),
                tag("c2", 0.0),
                tag("k", *bulk_mpa),
                pressure(2),
            ],
        )),
        Form::MooneyRivlin {
            c10_mpa,
            c01_mpa,
            bulk_mpa,
        } => Ok((
            "Mooney-Rivlin",
            vec![
                tag("c1", *c10_mpa),
                tag("c2", *c01_mpa),
                tag("k", *bulk_mpa),
                pressure(2),
            ],
        )),
        Form::Ogden { terms, volume } => {
            check_terms(program, "Ogden's law", terms.len())?;
            let pairs: Vec<(f64, f64)> = terms.iter().map(|t| (t.shear_mpa, t.exponent)).collect();
            let mut tags = sum(&pairs);
            match volume {
                VolumeEnergy::Logarithm(bulk) => tags.extend([tag("k", *bulk), pressure(0)]),
                VolumeEnergy::Powers(powers)
                    if powers.iter().skip(1).all(|c| *c == 0.0) && !powers.is_empty() =>
                {
                    tags.extend([tag("k", 2.0 * powers[0]), pressure(2)]);
                }
                VolumeEnergy::Powers(_) => {
                    let reason = "it has (J − 1)² alone, not its higher powers";
                    return Err(refused(
                        program,
                        "Ogden's law with several powers of J − 1",
                        reason,
                    ));
                }
            }
            Ok(("Ogden", tags))
        }
        Form::Hyperfoam { terms } => {
            check_terms(program, "the hyperfoam law", terms.len())?;
            if terms.iter().any(|t| t.poisson != 0.0) {
                let reason = "it has no powers of J, which Poisson's ratios other than 0 make";
                return Err(refused(program, "the hyperfoam law", reason));
            }
            let pairs: Vec<(f64, f64)> = terms.iter().map(|t| (t.shear_mpa, t.exponent)).collect();
            let mut tags = sum(&pairs);
            tags.push(tag("cp", 0.0));
            Ok(("Ogden unconstrained", tags))
        }
        Form::NeoHookeanLogarithmic {
            shear_mpa: mu,
            lame_lambda_mpa: lambda,
        } => {
            let young = mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu);
            let ratio = lambda / (2.0 * (lambda + mu));
            Ok(("neo-Hookean", vec![tag("E", young), tag("v", ratio)]))
        }
    }
}

#[cfg(test)]
#[path = "export_tests.rs"]
mod tests;
