//! Sums that do not depend on the order of their terms.

use std::collections::BTreeMap;

/// Many sums, each exact. Addition of floats is not associative: a sum of parts would depend on how the parts were cut.
/// Here, what a float64 sum cannot hold is kept in further float64 numbers (Shewchuk 1997), which a sum of float32 terms
/// seldom needs. So any order and any grouping of the same terms gives the same values, bit for bit.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ExactSums {
    /// The sums, correctly rounded.
    rounded: Vec<f64>,
    /// For sums that are not float64 numbers, by index: numbers of growing magnitude that do not overlap and add up to it.
    parts: BTreeMap<u64, Vec<f64>>,
}

/// The rounded sum of two numbers and what it lacks (Knuth).
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

impl ExactSums {
    /// Sums of nothing.
    pub(super) fn new(count: usize) -> Self {
        Self { rounded: vec![0.0; count], parts: BTreeMap::new() }
    }

    /// Number of sums.
    pub(super) fn len(&self) -> usize {
        self.rounded.len()
    }

    /// All sums, correctly rounded to float64.
    pub(super) fn rounded(&self) -> &[f64] {
        &self.rounded
    }

    /// Adds a finite number to the sum of this index.
    pub(super) fn add(&mut self, index: usize, value: f64) {
        let (sum, lost) = two_sum(self.rounded[index], value);
        // What is lost would be that of the rounded number, not of the sum, where there are parts.
        if lost == 0.0 && (self.parts.is_empty() || !self.parts.contains_key(&(index as u64))) {
            self.rounded[index] = sum;
            return;
        }
        let parts = self.parts.entry(index as u64).or_insert_with(|| vec![self.rounded[index]]);
        let mut carry = value;
        let mut kept = 0;
        for at in 0..parts.len() {
            let (high, low) = two_sum(carry, parts[at]);
            if low != 0.0 {
                parts[kept] = low;
                kept += 1;
            }
            carry = high;
        }
        parts.truncate(kept);
        if carry != 0.0 || kept == 0 {
            parts.push(carry);
        }
        self.rounded[index] = round(parts);
        if parts.len() == 1 {
            self.parts.remove(&(index as u64));
        }
    }

    /// Adds other sums of the same number.
    pub(super) fn add_all(&mut self, other: &Self) {
        for (index, &value) in other.rounded.iter().enumerate() {
            match other.parts.get(&(index as u64)) {
                Some(parts) => parts.iter().for_each(|&part| self.add(index, part)),
                None => self.add(index, value),
            }
        }
    }

    /// The sums as bytes, little-endian.
    pub(super) fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = bytemuck::cast_slice(&self.rounded).to_vec();
        bytes.extend((self.parts.len() as u64).to_le_bytes());
        for (index, parts) in &self.parts {
            bytes.extend([*index, parts.len() as u64].iter().flat_map(|number| number.to_le_bytes()));
            bytes.extend_from_slice(bytemuck::cast_slice(parts));
        }
        bytes
    }

    /// Parses `count` sums, and returns the bytes behind them; `None` if the bytes are not such sums.
    pub(super) fn from_bytes(bytes: &[u8], count: usize) -> Option<(Self, &[u8])> {
        let numbers = |bytes: &[u8]| -> Vec<f64> { bytemuck::pod_collect_to_vec(bytes) };
        let whole = |bytes: &mut &[u8]| {
            let (head, rest) = bytes.split_first_chunk::<8>()?;
            *bytes = rest;
            Some(u64::from_le_bytes(*head))
        };
        let (rounded, mut rest) = bytes.split_at_checked(count.checked_mul(8)?)?;
        let mut parts = BTreeMap::new();
        for _ in 0..whole(&mut rest)? {
            let (index, length) = (whole(&mut rest)?, usize::try_from(whole(&mut rest)?).ok()?);
            let (own, behind) = rest.split_at_checked(length.checked_mul(8)?)?;
            (index < count as u64 && length > 0).then_some(())?;
            parts.insert(index, numbers(own));
            rest = behind;
        }
        Some((Self { rounded: numbers(rounded), parts }, rest))
    }
}

/// The sum of numbers of growing magnitude that do not overlap, correctly rounded (to even, where it lies in the middle).
fn round(parts: &[f64]) -> f64 {
    let mut rest = parts.iter().rev().copied();
    let mut high = rest.next().unwrap_or(0.0);
    while let Some(next) = rest.next() {
        let (sum, lost) = two_sum(high, next);
        high = sum;
        if lost != 0.0 {
            // Half a unit in the last place was rounded to even, but what follows decides.
            let twice = lost * 2.0;
            let further = high + twice;
            let is_half = further - high == twice;
            let follows = rest.next().is_some_and(|behind| (behind > 0.0) == (lost > 0.0));
            return if is_half && follows { further } else { high };
        }
    }
    high
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// Numbers from tiny to huge, of both signs, from a linear congruential generator.
    fn terms(count: u64) -> Vec<f64> {
        let mut seed = 11u64;
        (0..count)
            .map(|_| {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let mantissa = ((seed >> 32) as u32 & 0xff_ffff) as f32 + 1.0;
                let sign = if seed & (1 << 60) == 0 { 1.0 } else { -1.0 };
                f64::from(sign * mantissa * ((seed >> 40 & 127) as f32 - 90.0).exp2())
            })
            .collect()
    }

    fn sum(terms: &[f64]) -> ExactSums {
        let mut sums = ExactSums::new(1);
        terms.iter().for_each(|&term| sums.add(0, term));
        sums
    }

    #[test]
    fn every_order_and_grouping_gives_the_same_sum() {
        let terms = terms(1000);
        let whole = sum(&terms).rounded()[0];
        let mut reversed = terms.clone();
        reversed.reverse();
        assert_eq!(sum(&reversed).rounded()[0].to_bits(), whole.to_bits());
        let naive = |terms: &[f64]| terms.iter().sum::<f64>().to_bits();
        assert_ne!(naive(&terms), naive(&reversed), "terms whose float64 sum depends on the order");
        for size in [1, 7, 64, 999] {
            let mut grouped = ExactSums::new(1);
            for chunk in terms.chunks(size).rev() {
                let bytes = sum(chunk).to_bytes();
                let (part, rest) = ExactSums::from_bytes(&bytes, 1).unwrap();
                assert!(rest.is_empty());
                grouped.add_all(&part);
            }
            assert_eq!(grouped.rounded()[0].to_bits(), whole.to_bits(), "groups of {size}");
        }
        // All terms and their opposites are nothing.
        let opposite: Vec<f64> = terms.iter().map(|term| -term).collect();
        let mut nothing = sum(&terms);
        opposite.iter().for_each(|&term| nothing.add(0, term));
        assert_eq!((nothing.rounded()[0], nothing.parts.len()), (0.0, 0));
    }

    #[test]
    fn sums_are_rounded_once() {
        let big = 2f64.powi(53);
        // Half a unit alone goes to even; with the least that follows it goes up.
        assert_eq!(sum(&[big, 1.0]).rounded()[0], big);
        assert_eq!(sum(&[big, 1.0, 1e-30]).rounded()[0], big + 2.0);
        assert_eq!(sum(&[1e-30, 1.0, big]).rounded()[0], big + 2.0);
        assert_eq!(sum(&[big, 1.0, -1e-30]).rounded()[0], big);
        assert_eq!(sum(&[1e30, 1.0, -1e30]).rounded()[0], 1.0);
        assert!(ExactSums::from_bytes(&[0; 15], 1).is_none(), "cut off");
    }
}
