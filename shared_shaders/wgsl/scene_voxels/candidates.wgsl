// Resampled importance sampling (Talbot et al. 2005): one of several sources is tested by a ray and stands for all of
// them. The mean is that of a ray to each source.

/// The candidates so far: the sum of their contributions, and the one that was chosen in proportion to its
/// contribution.
struct Candidates {
    strength: f32,
    picked: u32,
    // One random number serves all choices: its remainder after each choice is uniform again.
    choice: f32,
}

fn with_candidate(so_far: Candidates, index: u32, strength: f32) -> Candidates {
    let all = so_far.strength + strength;
    let threshold = so_far.choice * all;
    let pick = threshold < strength;
    let left = select(threshold - strength, threshold, pick) / max(select(so_far.strength, strength, pick), 1e-36);
    return Candidates(
        all,
        select(so_far.picked, index, pick),
        select(so_far.choice, min(left, 0.99999994), strength > 0.0),
    );
}

/// The random number for the next candidates: steps of the golden ratio fill the interval evenly.
fn next_choice(choice: f32) -> f32 {
    return fract(choice + 0.6180339887498949);
}
