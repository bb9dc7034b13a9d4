// One of several sources that stands for all of them where its ray is free (resampled importance sampling, Talbot et
// al. 2005): the mean stays what rays to all of them would bring.

/// Candidates so far: what all of them would bring, and the one that was picked in proportion to that.
struct Candidates {
    strength: f32,
    picked: u32,
    // One number serves all choices: what is left of it after each one is as random as before.
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

/// The number for the next candidates: the golden ratio's steps fill the line evenly.
fn next_choice(choice: f32) -> f32 {
    return fract(choice + 0.6180339887498949);
}
