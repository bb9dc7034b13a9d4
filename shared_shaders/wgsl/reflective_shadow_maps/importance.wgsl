// Estimate of a lit surface's importance: its contribution to a few receivers spread over the screen.

// Receivers along one side of the screen.
const RECEIVERS: u32 = 8u;
// Weight of the part that ignores orientation, because receivers between the sampled ones may face any way.
const ANY_WAY: f32 = 0.1;
