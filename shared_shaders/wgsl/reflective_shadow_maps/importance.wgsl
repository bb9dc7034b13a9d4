// How the importance of a lit surface is estimated: by what it would bring to a few receivers spread over the screen.

// Receivers along one side of the screen.
const RECEIVERS: u32 = 8u;
// Part of the importance that asks for nearness alone: a receiver that was not looked at may be turned any way.
const ANY_WAY: f32 = 0.1;
