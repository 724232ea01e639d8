"""Where a path's numbers lie in the two flat arrays the kernel reads: by the names of their places."""

# Places in a path's `places`; those from A on are offsets into its `numbers`.
STATES = 0  # number n of linear states
AWAY_STATES = 1  # number m of disturbance states
INPUT_END = 2  # effects before it act on the input,
STATE_END = 3  # those before it inside the path,
EFFECTS = 4  # the rest, up to this number, on the output
A = 5  # (n, n) by rows
B = 6  # (n,)
E = 7  # (n,)
C = 8  # (n,)
VELOCITY = 9  # (n,)
AWAY_A = 10  # (m, m) by rows; the disturbance path's input is in Pa
AWAY_B = 11  # (m,)
AWAY_C = 12  # (m,)
AWAY_VELOCITY = 13  # (m,)
PARAMETERS = 14
STATE_AT = 15  # offset of the path's linear states in the state; then disturbance states, then effects' memory
PRESENT = 16  # 0: an absent path, whose steps are spared
PER_EFFECT = 17  # then three places an effect: address, parameters' offset, memory's offset

# The first numbers of a path.
DIRECT = 0  # output per volt, at once
DIRECT_VELOCITY = 1
AWAY_DIRECT = 2  # output per Pa, at once
AWAY_DIRECT_VELOCITY = 3
GAIN_VELOCITY = 4  # free velocity at the sub-step's end per volt
GAIN_OUTPUT = 5  # free output at the sub-step's end per volt
GAIN_INJECTION = 6  # free output at the sub-step's end per injection
GAIN_INJECTED_VELOCITY = 7
REST_OUTPUT = 8  # SI
DECAY = 9  # of what is injected, 1/s
INLET_DECAY = 10  # of the store before, 1/s
STATIC = 11  # output per volt at rest
SETTLING = 12  # one over the mean lag, 1/s
SPEED = 13  # velocity per volt in steady motion
HEADER = 14
