//! Between a record's numbers and the law that they stand for.

use super::energy::EnergyRbf;
use super::homogeneous::{simple_shear, uniaxial};
use super::hyperelastic::Hyperelastic;
use super::isotropic::IsotropicRbf;
use super::law::{Law, LawError, Range};
use super::record::{
    Centre, CheckPair, Formulation, Kind, MaterialRecord, Model, ModelRange, RecordError, Uncertainty,
    rounded, significant,
};
use super::transverse::{TransverseModuli, TransverseRbf};
use crate::math::mandel::Mandel;
use crate::math::multiquadric::Multiquadric;
use crate::math::rbf::LinearRbf;

impl MaterialRecord {
    /// The law of the stored weights, axis along z.
    ///
    /// # Errors
    /// Numbers that make no law; the message names the record.
    pub fn law(&self) -> Result<Law, RecordError> {
        let named = |source| RecordError::Law {
            id: self.id.clone(),
            source,
        };
        let model = &self.model;
        if let Some(form) = &model.hyperelastic {
            let law = Hyperelastic::new(form.clone());
            return law.map(Law::Hyperelastic).map_err(named);
        }
        match self.kind {
            Kind::Isotropic if model.formulation == Formulation::Energy => {
                let range = model.range.invariants::<3>().map_err(named)?;
                let rbf = model.interpolant::<3, 2>().map_err(named)?;
                let smooth = Multiquadric {
                    centres: rbf.centres,
                    weights: rbf.weights,
                    constant: rbf.constant,
                    offset: model.offset.unwrap_or(0.0),
                };
                let law = EnergyRbf::from_weights(smooth, range);
                law.map(|law| Law::Energy(Box::new(law))).map_err(named)
            }
            Kind::Isotropic => {
                let range = model.range.invariants::<3>().map_err(named)?;
                let law = IsotropicRbf::from_weights(model.interpolant::<3, 2>().map_err(named)?, range);
                law.map(Law::Isotropic).map_err(named)
            }
            Kind::TransverselyIsotropic => {
                let range = model.range.invariants::<4>().map_err(named)?;
                let law = TransverseRbf::from_weights(model.interpolant::<4, 5>().map_err(named)?, range);
                law.map(|law| Law::TransverselyIsotropic(Box::new(law)))
                    .map_err(named)
            }
        }
    }

    /// The law that the moduli at the centres make, for comparison with the stored weights.
    ///
    /// # Errors
    /// Moduli that make no law.
    pub fn law_from_moduli(&self) -> Result<Law, RecordError> {
        let named = |source| RecordError::Law {
            id: self.id.clone(),
            source,
        };
        let model = &self.model;
        if model.hyperelastic.is_some() {
            return self.law();
        }
        match self.kind {
            Kind::Isotropic if model.formulation == Formulation::Energy => {
                let (centres, moduli) = model.rows::<3, 2>().map_err(named)?;
                let range = model.range.invariants::<3>().map_err(named)?;
                EnergyRbf::interpolating(&centres, &moduli, model.offset.unwrap_or(0.0), range)
                    .map(|law| Law::Energy(Box::new(law)))
                    .map_err(named)
            }
            Kind::Isotropic => {
                let (centres, moduli) = model.rows::<3, 2>().map_err(named)?;
                let range = model.range.invariants::<3>().map_err(named)?;
                IsotropicRbf::interpolating(&centres, &moduli, range)
                    .map(Law::Isotropic)
                    .map_err(named)
            }
            Kind::TransverselyIsotropic => {
                let (centres, moduli) = model.rows::<4, 5>().map_err(named)?;
                let moduli: Vec<_> = moduli.into_iter().map(TransverseModuli::from_array).collect();
                let range = model.range.invariants::<4>().map_err(named)?;
                TransverseRbf::interpolating(&centres, &moduli, range)
                    .map(|law| Law::TransverselyIsotropic(Box::new(law)))
                    .map_err(named)
            }
        }
    }
}

type Rows<const D: usize, const V: usize> = (Vec<[f64; D]>, Vec<[f64; V]>);

fn fixed<const N: usize>(list: &[f64]) -> Result<[f64; N], LawError> {
    list.try_into()
        .map_err(|_| LawError::Weights(format!("{} numbers where {N} belong", list.len())))
}

impl ModelRange {
    /// The box of the law.
    fn invariants<const D: usize>(&self) -> Result<Range<D>, LawError> {
        Range::new(fixed(&self.low)?, fixed(&self.high)?)
    }
}

impl Model {
    fn interpolant<const D: usize, const V: usize>(&self) -> Result<LinearRbf<D, V>, LawError> {
        let centres = self
            .centres
            .iter()
            .map(|c| fixed(&c.invariants))
            .collect::<Result<_, _>>()?;
        let weights = self
            .centres
            .iter()
            .map(|c| fixed(&c.weights))
            .collect::<Result<_, _>>()?;
        Ok(LinearRbf {
            centres,
            weights,
            constant: fixed(&self.constant)?,
        })
    }

    fn rows<const D: usize, const V: usize>(&self) -> Result<Rows<D, V>, LawError> {
        let centres = self
            .centres
            .iter()
            .map(|c| fixed(&c.invariants))
            .collect::<Result<_, _>>()?;
        let moduli = self
            .centres
            .iter()
            .map(|c| fixed(&c.moduli_mpa))
            .collect::<Result<_, _>>()?;
        Ok((centres, moduli))
    }

    /// The stored form of a law.
    ///
    /// # Errors
    /// [`LawError::Unrecorded`] for the papers' form.
    pub fn of(law: &Law, engineering_strain: [f64; 2]) -> Result<Self, LawError> {
        let range = ModelRange {
            engineering_strain,
            low: Vec::new(),
            high: Vec::new(),
        };
        let mut model = Model {
            formulation: Formulation::Secant,
            offset: None,
            constant: Vec::new(),
            range,
            centres: Vec::new(),
            hyperelastic: None,
        };
        match law {
            Law::Isotropic(law) => {
                let rbf = law.log_moduli();
                model.set(&rbf.constant, law.range());
                model.centres = rows(&rbf.centres, &rbf.weights, |q| {
                    rbf.value(q).map(f64::exp).to_vec()
                });
            }
            Law::TransverselyIsotropic(law) => {
                let rbf = law.parameters();
                let moduli = |q: &_| {
                    TransverseModuli::from_parameters(&rbf.value(q))
                        .to_array()
                        .to_vec()
                };
                model.set(&rbf.constant, law.range());
                model.centres = rows(&rbf.centres, &rbf.weights, moduli);
            }
            Law::Energy(law) => {
                let rbf = law.log_moduli();
                model.formulation = Formulation::Energy;
                model.offset = Some(rbf.offset);
                model.set(&rbf.constant, law.range());
                model.centres = rows(&rbf.centres, &rbf.weights, |q| {
                    rbf.value(q).map(f64::exp).to_vec()
                });
            }
            Law::Hyperelastic(law) => model.hyperelastic = Some(law.form().clone()),
            Law::Paper(_) => return Err(LawError::Unrecorded),
        }
        Ok(model)
    }

    fn set<const D: usize>(&mut self, constant: &[f64], range: &Range<D>) {
        self.constant = constant.to_vec();
        self.range.low = range.low().to_vec();
        self.range.high = range.high().to_vec();
    }
}

fn rows<const D: usize, const V: usize>(
    centres: &[[f64; D]],
    weights: &[[f64; V]],
    moduli: impl Fn(&[f64; D]) -> Vec<f64>,
) -> Vec<Centre> {
    let centre = |(q, w): (&[f64; D], &[f64; V])| Centre {
        invariants: q.to_vec(),
        // Twelve digits: for people, and without the last bits' noise of exp and ln.
        moduli_mpa: moduli(q).iter().map(|&m| significant(m, 12)).collect(),
        weights: w.to_vec(),
    };
    centres.iter().zip(weights).map(centre).collect()
}

impl CheckPair {
    /// A few strains over a range of engineering strain with the stresses that `law`, its axis along z, answers.
    pub fn over(law: &Law, [low, high]: [f64; 2]) -> Vec<CheckPair> {
        let mut strains: Vec<Mandel> = Vec::new();
        for axial in [0.5 * low, low, 0.5 * high, high] {
            if axial != 0.0 {
                strains.push(uniaxial(law, axial).strain());
            }
        }
        strains.push(simple_shear(0.2).0);
        strains.push(Mandel::new(-0.1, 0.05, 0.02, 0.04, -0.03, 0.06));
        strains
            .into_iter()
            .map(|strain| {
                // Rounded first, so that the stress belongs to the strain that the file shows.
                let strain = strain.map(|x| rounded(x, 6));
                let stress = law.stress(&strain).map(|x| significant(x, 12));
                CheckPair {
                    strain: strain.into(),
                    stress_mpa: stress.into(),
                }
            })
            .collect()
    }
}

impl Uncertainty {
    /// A covariance `(n × n)` of the parameters of `law` as a record shows it, to six digits; none if it is not finite.
    pub fn of(law: &Law, covariance: &[Vec<f64>], basis: String) -> Option<Uncertainty> {
        let six = |x: &f64| significant(*x, 6);
        let finite = covariance.iter().flatten().all(|x| x.is_finite());
        (finite && !covariance.is_empty()).then(|| Uncertainty {
            parameters: law.parameters().into_iter().map(|p| p.name).collect(),
            covariance: covariance
                .iter()
                .map(|row| row.iter().map(six).collect())
                .collect(),
            basis,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::hyperelastic::{FoamTerm, Form, OgdenTerm, VolumeEnergy};
    use crate::math::mandel::Mandel;
    use std::path::Path;

    fn round_trip(law: &Law) -> Law {
        let file = Path::new("a.toml");
        let text = include_str!("../../materials-db/body-double-silk.toml");
        let (mut record, _) = MaterialRecord::parse(text, file).unwrap();
        record.model = Model::of(law, [-0.3, 0.3]).unwrap();
        let (read, unknown) = MaterialRecord::parse(&record.to_toml().unwrap(), file).unwrap();
        assert!(unknown.is_empty(), "{unknown:?}");
        assert_eq!(read.model, record.model);
        read.law().unwrap()
    }

    #[test]
    fn laws_with_an_energy_come_back_from_their_file() {
        let centres = [[0.0, 0.0, 0.0], [-0.05, 0.2, -0.2]];
        let range = Range::new([-0.1, 0.0, -0.3], [0.0, 0.3, 0.0]).unwrap();
        let energy = EnergyRbf::interpolating(&centres, &[[0.1, 0.2], [0.3, 0.4]], 0.1, range).unwrap();
        let foam = Form::Hyperfoam {
            terms: vec![FoamTerm {
                shear_mpa: 0.1,
                exponent: 4.0,
                poisson: 0.1,
            }],
        };
        let ogden = Form::Ogden {
            terms: vec![OgdenTerm {
                shear_mpa: 0.1,
                exponent: 1.5,
            }],
            volume: VolumeEnergy::Powers(vec![1.0, 0.2]),
        };
        let strain = Mandel::new(-0.1, 0.02, 0.05, 0.1, 0.0, 0.03);
        for law in [
            Law::Energy(Box::new(energy)),
            Law::Hyperelastic(Hyperelastic::new(foam).unwrap()),
            Law::Hyperelastic(Hyperelastic::new(ogden).unwrap()),
        ] {
            assert_eq!(round_trip(&law).stress(&strain), law.stress(&strain));
        }
    }
}
