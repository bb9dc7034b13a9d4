//! The stages of a search.

use super::{Cell, Estimate, Goal, Id, Search, Stage, TOO_SLOW, mean};

/// Share of the time after which effects end, combinations end.
const ENDS: [f64; 2] = [0.5, 0.7];
/// Families that are left after the defaults.
const KEPT: usize = 3;
/// A family goes on as long as its best prediction is within this factor of the best of all.
const CLOSE: f64 = 1.3;
/// Share of the cells after which effects end.
const EFFECTS: f64 = 0.55;
/// Most cells of combinations and of verification, without the two steps.
const MOST_COMBINATIONS: usize = 10;
const MOST_VERIFICATIONS: usize = 6;
/// Steps up and down that are measured after the answer.
const STEPS: usize = 2;
/// Candidates of a family that are all looked at. Of a larger one, those that a descent from the best ones meets.
const ENUMERATED: f64 = 1500.0;
/// Measured candidates that a descent starts from.
const STARTS: usize = 3;
/// An infeasible candidate loses by this power of its excess.
const EXCESS: f64 = 8.0;
/// The same before a family's settings were tried: error falls at most with the root of time as long as noise dominates,
/// so a family whose default is slow may still win with faster settings.
const UNTRIED_EXCESS: f64 = 0.5;
/// A step is at least this much faster or slower than the answer.
const STEP: f64 = 2.0;

impl Search {
    /// The next cell to measure; `None` when the search is done. `spent` is the share of the time that has passed: from 1
    /// on, only what an answer cannot do without is measured.
    ///
    /// A cell that was not reported is given again.
    pub fn next(&mut self, spent: f64) -> Option<Cell> {
        if let Some((cell, _)) = &self.pending {
            return Some(cell.clone());
        }
        let (id, predicted) = self.choose(spent)?;
        let (technique, settings) = match &id.candidate {
            Some((family, candidate)) => {
                let family = &self.families[*family];
                (family.technique, family.settings(candidate))
            }
            None => (halflight_techniques::technique("none").ok()?, Default::default()),
        };
        let slowest_ms = match self.request.goal {
            Goal::Budget(budget) => TOO_SLOW * budget,
            Goal::ErrorBound(_) => f64::INFINITY,
        };
        let size = if id.full { self.request.size } else { self.request.reduced };
        let cell = Cell { technique, settings, size, stage: self.stage, slowest_ms, id };
        self.pending = Some((cell.clone(), predicted));
        Some(cell)
    }

    /// Plans up to `count` candidates that [`Search::next`] would plan. Returns whether more are left. Programs that must not
    /// block call it until then: `next` may plan thousands of candidates at once, in about 0.2 ms each.
    pub fn plan_ahead(&mut self, count: usize) -> bool {
        if [Stage::Defaults, Stage::Done].contains(&self.stage) {
            return false;
        }
        let mut left = count;
        for family in self.alive.clone() {
            if self.families[family].size() > ENUMERATED {
                continue;
            }
            for candidate in self.families[family].candidates() {
                if self.plans.contains_key(&(family, true, candidate.clone())) {
                    continue;
                }
                if left == 0 {
                    return true;
                }
                left -= 1;
                self.planned(family, &candidate, true);
            }
        }
        false
    }

    fn choose(&mut self, spent: f64) -> Option<(Id, Option<[f64; 2]>)> {
        if self.baseline[0].is_none() {
            return Some((Id { candidate: None, full: false }, None));
        }
        // Where there is no indirect light, or no surface, nothing can be compared.
        if !self.baseline[0].as_ref().is_some_and(|measured| mean(&measured.errors) > 0.0) {
            self.stage = Stage::Done;
        }
        loop {
            let stage = self.stage;
            let next = match stage {
                Stage::Defaults => self.next_default(spent),
                Stage::Effects => self.next_effect(spent),
                Stage::Combinations => self.next_combination(spent),
                Stage::Verification => return self.next_verification(spent),
                Stage::Done => return None,
            };
            if let Some((family, candidate)) = next {
                return Some((Id { candidate: Some((family, candidate)), full: false }, None));
            }
            if stage == Stage::Defaults
                && let Some((family, candidate)) = self.next_anchor(spent)
            {
                return Some((Id { candidate: Some((family, candidate)), full: true }, None));
            }
            self.stage = match stage {
                Stage::Defaults => Stage::Effects,
                Stage::Effects => Stage::Combinations,
                _ => Stage::Verification,
            };
        }
    }

    /// Whether what a candidate does was measured at reduced or full size, or was refused.
    fn is_known(&mut self, family: usize, candidate: &[usize]) -> bool {
        self.planned(family, candidate, true).is_none_or(|planned| {
            [false, true].iter().any(|&full| self.record(family, planned.fingerprint, full).is_some())
        })
    }

    fn next_default(&mut self, spent: f64) -> Option<(usize, Vec<usize>)> {
        let time_is_up = spent >= 1.0 && self.records.iter().any(|record| record.measured.is_some());
        let all: Vec<usize> = if time_is_up { Vec::new() } else { (0..self.families.len()).collect() };
        let next = all.into_iter().find_map(|family| {
            let defaults = vec![0; self.families[family].axes.len()];
            (!self.is_known(family, &defaults)).then_some((family, defaults))
        });
        if next.is_none() && self.round == 0 {
            self.halve();
            self.start_round();
        }
        next
    }

    /// The best cell of each family that is left, at full size: how time and error change with the size.
    fn next_anchor(&mut self, spent: f64) -> Option<(usize, Vec<usize>)> {
        if spent > ENDS[0] || self.one_size() {
            return None;
        }
        self.alive.clone().into_iter().find_map(|family| {
            let anchored = self.records.iter().any(|record| record.family == family && record.full);
            let best = self.best_measured(family, 1).into_iter().next();
            best.filter(|_| !anchored).map(|best| (family, best.candidate))
        })
    }

    /// Keeps the better half of the families, but at least [`KEPT`] after the defaults and two after later rounds.
    fn halve(&mut self) {
        let first = self.round == 0;
        let score = |search: &mut Self, family| {
            // One cell tells nothing of the effects of settings, so predictions would be as good as wishes.
            let (best, excess) = match first {
                true => (search.best_measured(family, 1).into_iter().next(), UNTRIED_EXCESS),
                false => (search.best_in(family, search.request.goal), EXCESS),
            };
            best.map_or(f64::INFINITY, |best| search.score(&best, excess))
        };
        let mut scored: Vec<(f64, usize)> =
            self.alive.clone().into_iter().map(|family| (score(self, family), family)).collect();
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        scored.truncate(scored.len().div_ceil(2).max(if first { KEPT } else { 2 }));
        self.alive = scored.into_iter().map(|(_, family)| family).collect();
    }

    /// A round tries half of the axes of each family.
    fn start_round(&mut self) {
        self.quota = self.families.iter().map(|family| family.axes.len().div_ceil(2)).collect();
        self.round += 1;
    }

    fn next_effect(&mut self, spent: f64) -> Option<(usize, Vec<usize>)> {
        if spent > ENDS[0] || self.cells as f64 > EFFECTS * self.most_cells() as f64 {
            return None;
        }
        // Until no family has a value left that was not tried and does something.
        loop {
            // The family with most of its quota left comes next, so that all get their turn.
            let mut order = self.alive.clone();
            order.sort_by_key(|&family| std::cmp::Reverse(self.quota[family]));
            let open = order.iter().any(|&family| self.quota[family] > 0);
            for family in order.into_iter().filter(|&family| !open || self.quota[family] > 0).collect::<Vec<_>>() {
                if let Some(candidate) = self.untried(family) {
                    self.quota[family] = self.quota[family].saturating_sub(1);
                    return Some((family, candidate));
                }
                self.quota[family] = 0;
            }
            if !open {
                return None;
            }
            self.halve();
            self.start_round();
            let alive = self.alive.clone();
            if alive.into_iter().all(|family| self.untried(family).is_none()) {
                return None;
            }
        }
    }

    /// The best candidate of a family with one value changed that was not tried before and does something.
    fn untried(&mut self, family: usize) -> Option<Vec<usize>> {
        let base = self.best_measured(family, 1).into_iter().next()?.candidate;
        let axes = self.families[family].axes.clone();
        for (index, axis) in axes.iter().enumerate() {
            for value in worth_trying(axis) {
                if self.tried[family].contains(&(index, value)) || base[index] == value {
                    continue;
                }
                let mut candidate = base.clone();
                candidate[index] = value;
                // What has no effect here may have one beside another setting: it stays untried.
                if !self.is_known(family, &candidate) {
                    self.tried[family].push((index, value));
                    return Some(candidate);
                }
            }
        }
        None
    }

    /// The best prediction of each family that is left and close to the best of all, as long as it was not measured.
    fn next_combination(&mut self, spent: f64) -> Option<(usize, Vec<usize>)> {
        let full = self.cells + MOST_VERIFICATIONS > self.most_cells();
        if spent > ENDS[1] || self.combinations >= MOST_COMBINATIONS || full {
            return None;
        }
        let goal = self.request.goal;
        let best = self.best(goal)?;
        let limit = score(goal, &best, EXCESS) + CLOSE.ln();
        let mut own: Vec<Estimate> =
            self.alive.clone().into_iter().filter_map(|family| self.best_in(family, goal)).collect();
        own.retain(|estimate| !estimate.reduced && score(goal, estimate, EXCESS) <= limit);
        own.sort_by(|a, b| score(goal, a, EXCESS).total_cmp(&score(goal, b, EXCESS)));
        let next = own.into_iter().next()?;
        self.combinations += 1;
        Some((next.family, next.candidate))
    }

    fn next_verification(&mut self, spent: f64) -> Option<(Id, Option<[f64; 2]>)> {
        if self.baseline[1].is_none() {
            return Some((Id { candidate: None, full: true }, None));
        }
        let verify = |search: &mut Self, best: Estimate| {
            search.verifications += 1;
            let id = Id { candidate: Some((best.family, best.candidate)), full: true };
            Some((id, Some([best.time, best.error])))
        };
        let best = self.best(self.request.goal);
        let some_verified = self.records.iter().any(|record| record.full && record.measured.is_some());
        if let Some(best) = best.filter(|best| !best.verified)
            && self.verifications < MOST_VERIFICATIONS
            && (spent < 1.0 && self.cells + STEPS < self.most_cells() || !some_verified)
        {
            return verify(self, best);
        }
        // What more and less time would give.
        if spent < 1.0
            && let Some(answer) = self.best_verified()
        {
            while self.steps < STEPS {
                let factor = if self.steps == 0 { STEP } else { 1.0 / STEP };
                self.steps += 1;
                if let Some(step) = self.best(Goal::Budget(answer.time * factor)).filter(|step| !step.verified) {
                    return verify(self, step);
                }
            }
        }
        self.stage = Stage::Done;
        None
    }

    /// Lower is better.
    fn score(&self, estimate: &Estimate, excess: f64) -> f64 {
        score(self.request.goal, estimate, excess)
    }

    /// All that was measured, once for each fingerprint, as known at full size.
    pub(crate) fn measured(&mut self) -> Vec<Estimate> {
        let mut seen: Vec<(usize, u64)> = Vec::new();
        let mut estimates = Vec::new();
        for record in self.records.clone() {
            let key = (record.family, record.fingerprint);
            if record.measured.is_some() && !seen.contains(&key) {
                seen.push(key);
                estimates.extend(self.estimate(record.family, &record.candidate));
            }
        }
        estimates
    }

    fn best_measured(&mut self, family: usize, count: usize) -> Vec<Estimate> {
        let mut own: Vec<Estimate> = self.measured().into_iter().filter(|e| e.family == family).collect();
        own.sort_by(|a, b| self.score(a, EXCESS).total_cmp(&self.score(b, EXCESS)));
        own.truncate(count);
        own
    }

    /// The best of what was measured at full size.
    pub(crate) fn best_verified(&mut self) -> Option<Estimate> {
        let verified = self.measured().into_iter().filter(|estimate| estimate.verified);
        let scored: Vec<_> = verified.map(|estimate| (self.score(&estimate, EXCESS), estimate)).collect();
        scored.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, estimate)| estimate)
    }

    /// The best candidate of all families that are left, as far as the models know.
    pub(crate) fn best(&mut self, goal: Goal) -> Option<Estimate> {
        // What was measured counts wherever it is.
        let mut all = self.measured();
        for family in self.alive.clone() {
            all.extend(self.best_in(family, goal));
        }
        all.into_iter().min_by(|a, b| score(goal, a, EXCESS).total_cmp(&score(goal, b, EXCESS)))
    }

    fn best_in(&mut self, family: usize, goal: Goal) -> Option<Estimate> {
        if self.families[family].size() <= ENUMERATED {
            let all = self.families[family].candidates();
            let estimates: Vec<_> = all.iter().filter_map(|candidate| self.estimate(family, candidate)).collect();
            return estimates.into_iter().min_by(|a, b| score(goal, a, EXCESS).total_cmp(&score(goal, b, EXCESS)));
        }
        let starts = self.best_measured(family, STARTS);
        let ends: Vec<_> = starts.into_iter().map(|start| self.descend(start, goal)).collect();
        ends.into_iter().min_by(|a, b| score(goal, a, EXCESS).total_cmp(&score(goal, b, EXCESS)))
    }

    /// Changes one setting after the other as long as the prediction becomes better.
    fn descend(&mut self, start: Estimate, goal: Goal) -> Estimate {
        let axes = self.families[start.family].axes.clone();
        let mut best = start;
        loop {
            let before = score(goal, &best, EXCESS);
            for (index, axis) in axes.iter().enumerate() {
                for value in 0..axis.values.len() {
                    let mut candidate = best.candidate.clone();
                    candidate[index] = value;
                    let Some(other) = self.estimate(best.family, &candidate) else { continue };
                    if other.fingerprint != best.fingerprint
                        && score(goal, &other, EXCESS) < score(goal, &best, EXCESS) - 1e-9
                    {
                        best = other;
                    }
                }
            }
            if score(goal, &best, EXCESS) >= before - 1e-9 {
                return best;
            }
        }
    }

    /// A share of the work that is done, 0..=1, from the stage and from the share of the time that has passed.
    pub fn progress(&self, spent: f64) -> f64 {
        let by_cells = self.cells as f64 / self.most_cells() as f64;
        if self.stage == Stage::Done { 1.0 } else { by_cells.max(spent).clamp(0.0, 0.99) }
    }
}

/// The natural logarithm of what the goal minimizes, plus what infeasible candidates lose.
fn score(goal: Goal, estimate: &Estimate, excess: f64) -> f64 {
    let (wanted, limited, limit) = match goal {
        Goal::Budget(budget) => (estimate.error, estimate.time_high, budget),
        Goal::ErrorBound(bound) => (estimate.time, estimate.error, bound),
    };
    let over = (limited / limit).ln().max(0.0);
    // Even a little too much is worse than anything that keeps a measured limit.
    let broken = if over > 0.0 && estimate.verified { 1e3 } else { 0.0 };
    let score = wanted.max(1e-12).ln() + excess * over + broken;
    if score.is_nan() { f64::INFINITY } else { score }
}

/// Values of an axis that must be measured to predict all: every word, and of numbers the smallest and the largest.
fn worth_trying(axis: &crate::family::Axis) -> Vec<usize> {
    let all = 0..axis.values.len();
    let numbers: Option<Vec<(f64, usize)>> = all.clone().map(|index| Some((axis.number(index)?, index))).collect();
    let Some(mut numbers) = numbers else { return all.skip(1).collect() };
    numbers.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut ends: Vec<usize> = numbers.first().into_iter().chain(numbers.last()).map(|&(_, index)| index).collect();
    ends.retain(|&index| index != 0);
    ends
}
