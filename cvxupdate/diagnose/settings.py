"""Every threshold of the diagnosis: its name, its unit, and why it is what it is. None was fitted
to a case. What only decides accuracy or memory of a computation stays beside that computation.
"""

from __future__ import annotations

# --------------------------------------------------------------- nominal model and its scatter
# Standard deviation of a group's p-value between drawing and laboratory: tolerance of modulus and
# section, and of density and section, of rolled metal.
STIFFNESS_STD, MASS_STD = 0.02, 0.012
# Of that: how far the pieces of one group, from one delivery, scatter about their common value;
# relative: stiffness of supports, anchors or bolted joints of one kind about theirs.
PIECE, ALIKE_STD = 0.25, 0.25
# Standard deviations: a nuisance parameter further off than this is a finding, not scatter; |p| of
# a group: how far a parameter error is followed.
CREDIBLE, WIDE = 3.5, 0.3
# Standard deviations of log ζ: of all modes together, of each mode by itself. Damping is hardly
# known beforehand, and the ratios of one structure scatter by about a third.
COMMON_DAMPING_STD, MODE_DAMPING_STD = 1.0, 0.35
# Of those deviations: a mode's own ratio beyond is one in twenty, and looked at again.
STRAYED = 2.0
# Standard deviation of the share of the loss that is hysteretic, about a half: as far as none and
# all are, for the word in a file is no evidence (programs ask for a ratio or a loss factor, and
# one is made from the other).
KIND_STD = 0.5
# Standard deviation of what has no prior.
FREE = 1e4
# Relative shift of a frequency by the mesh beyond which two modes are not one and the same; and of
# its deviation, by which it may move as the mesh's error of a fitted model's modes is another.
ANOTHER_MODE, SETTLED = 0.2, 0.5
# Element length in depths where a Timoshenko beam's errors of second and fourth order are equal.
SLENDER = 4.0
# Relative error of any natural frequency of the band that dividing exact members may leave: a third
# of what a sound model's frequencies may miss, before the mesh's error is extrapolated as ever.
EXACT_MESH = 1e-3
# Types of elements whose presence brings a finer mesh: extrapolated frequencies do not bring the
# shapes. Sheets, whose theory leaves more than their parameters can say; beams of plane frames
# where they meet at an angle, for what lies within a corner. A space frame has three times the
# inner coordinates: the search among them did not end within `BUDGET` (140 s of 19 nodes).
SHEET_TYPES, FRAME_TYPES = ("plate",), ("beam2d",)
# Relative shift of frequencies that shear makes of beams, up to which a model without it is sound:
# half the tolerance of the modulus, which shifts them as much. Above, its absence is a finding.
SOUND_THEORY = 0.01
# Shear that theory wants of stocky beams, in parts of what the section's coefficient gives, and how
# far it may be off: that is known within a fifth, of which this is two and a half.
BY_THEORY, NEAR_THEORY = 1.0, 0.5
# Part of what theory says of beams below which it is not written into a model: a twentieth of the
# hundredth of a frequency from which on its absence is a finding.
WRITTEN = 0.05
# Relative error of a natural frequency in the band by the file's mesh of rods and beams, from which
# on the file is diagnosed on a finer mesh: half the tolerance of a modulus shifts frequencies by 1
# %, and of five times that extrapolation to second order may miss as much.
COARSE_MESH = 0.05
# Parts of an element's edge with which the analysis model is made; the next where one leaves much.
MESH_PARTS = (8, 16)
# Fraction of the noise of the recordings, and of the discrepancy of a sound model, that what the
# mesh of the analysis model leaves may come to: added in quadrature it is then lost in either.
MESH_NOISE = 0.5
# Relative shift of a frequency by the mesh of the file from which on the page speaks of it.
MESH_TOLD = 1e-3
# Relative error of a natural frequency that mesh and theory of sheets may leave on a finer mesh,
# shear, rims, rotary inertia and clamps that reach in being nuisance parameters: half as much again
# as seven null plates by CalculiX leave (0.006 to 0.023 %); a free thin one of twelve elements
# leaves 0.030 % beside a mesh thirty times as fine.
SHEET_DISCREPANCY = 3.5e-4
# Response error: what mesh and theory of sheets may leave is never taken to be more.
MOST_ALLOWANCE = 0.3

# ------------------------------------------------------------------------------ what is detected
# Relative change of the transfer functions between drive levels, and how many times its noise, that
# make a structure nonlinear; fewer do beside distortion (`UNFORCED_PART`), which alone says so.
LEVEL_CHANGE, LEVEL_NOISE, DISTORTED_NOISE = 0.05, 5.0, 2.0
# The same from which on laws are tried beside all else; and from which on they are where a linear
# model explains the rest: twice what sampling made of nineteen linear structures (0.27 % at most).
SLIGHT_CHANGE, LEAST_CHANGE = 0.015, 0.005

# Relative change of frequency or width of resonances, and standard deviations, from which a
# tell-tale is told: less is what temperature does to any structure between two runs.
TELLTALE = (0.005, 4.0)
# Standardised third moment of a motion, and part of it on lines without force, that are told:
# what finite records and leakage of a linear structure do not reach.
LOPSIDED, UNFORCED_PART = 0.15, 0.02
# Fall of weighted squares for each unknown of a stiffness that goes with time: what chance, at
# chi-square with one degree of freedom, gives once in two thousand times, with room for rows that
# say the same.
CLOCK_GAIN = 36.0
# Part of what changes with the level leave beyond noise that it takes at least: laws that follow
# the motion leave it a hundredth; of a true drift the smoothed motion, and a fit that is bent by
# it, may hide two thirds.
CLOCK_PART = 0.15
# Relative change of a ring-down's damping that is told: neighbouring modes beat by less.
UNEVEN = 0.3

# ---------------------------------------------------------- weights: noise and model discrepancy
# Fraction of the local response: what the discretisation of a sound model may miss besides noise.
RESPONSE_DISCREPANCY = 0.01
# The same of a natural frequency (relative) and of a mode shape's entry (largest entry 1).
FREQUENCY_DISCREPANCY, SHAPE_DISCREPANCY = 0.003, 0.02
# m, rad: how far sensors and forces are beside their nodes, half of a small accelerometer's width,
# and off their directions; how many such errors of sensors are fitted along, at most.
BESIDE, TILTED, MOST_ASIDE = 0.005, 0.035, 60
# Beside a reference state, what both have in common being taken out: relative change of a
# frequency from day to day (ten kelvin), of a shape's entry by mounting sensors again; the part of
# what the model misses, and of what changed, that may differ between the states; of the groups'
# usual scatter; of a size, alike in all modes (likeliest of 21 well told, seeds 2500 to 2659).
REPEATED, SHAPE_REPEATED, COMMON, CALIBRATED, SIZED = 0.001, 0.005, 0.1, 0.1, 0.03
# Likewise deviations of log ζ: of each mode (cables, joints), of all together (temperature).
DAMPING_REPEATED, COMMON_DAMPING_REPEATED = 0.1, 0.2
# Relative error of what a change does to a frequency, for each unit of r.m.s. relative error of the
# frequencies: energies go with the square of shapes, and neighbouring shapes mix by somewhat more
# than frequencies are off.
SHAPES_OFF = 4.0
# Relative deviation of the frequency of a mode by itself, by which responses of a model that was
# brought to its reference may still be off.
TUNED_STD = 0.03
# Relative standard deviations where a file states none: of an FRF, a natural frequency, a shape's
# entry, a damping ratio.
UNSTATED_FRF, UNSTATED_FREQUENCY, UNSTATED_SHAPE, UNSTATED_DAMPING = 0.01, 0.005, 0.05, 0.1
# Deviation of the logarithm of a gain that is off (load cells that bend, old calibrations); of the
# sizes of effects beside which it is told: nine of ten are within a tenth.
GAIN_STD, SIZE_STD = 0.2, 0.1
# Relative: how well coherence or a quiet band tells the variance of the noise.
NOISE_KNOWN = 0.1
# Weighted squares per row: a tenth of the model discrepancy's; misfits below are equal.
RESOLVED = 0.01
# Times the model discrepancy above: levels over which the evidence for a hypothesis is averaged,
# from what rounding of a table's digits leaves to a model that misses a third of the responses.
LEAST_LEVEL, LARGEST_LEVEL = 0.05, 30.0
# Half-widths of the smoothing kernel, in parts of the frequency, from far-reaching to sharp.
LEVELS = (0.15, 0.05, 0.016, 0.005)

# ------------------------------------------------------------------------------------- screening
# Candidates kept of one effect type and in all, from first order; from finite sizes.
EACH, SHORT, EACH_SIZED = 3, 12, 4
# Fraction of the largest explained fraction: candidates below are not refitted.
NEAR = 0.25
# Effects on whole groups: compared by first order, tried at finite sizes, refitted.
MEMBERS, WHOLES, WHOLE = 16, 6, 3
# Fraction of the half-samples that makes a candidate worth a refit whatever its explained
# fraction (Meinshausen and Bühlmann 2010: 0.6 to 0.9).
STABLE = 0.7
# r.m.s. relative error of the frequencies above which a derivative says little of a whole member.
FAR_OFF = 0.05
# Masses of hidden oscillators, parts of the structure's: a fifth is a structure beside it.
OSCILLATOR_MASSES = (0.001, 0.003, 0.01, 0.03, 0.1, 0.2)

# ---------------------------------------------------------------------------------------- search
# (level, how many enter) of the race on smooth recordings, and on sharp ones; where several
# effects are sought, at which level they are refitted.
COARSE, FINE = ((0, 16), (1, 8)), ((2, 5), (3, 4))
SEVERAL_LEVEL = 1
FINE_SEVERAL = ((2, 4), (3, 3))
# Relative fall of the misfit that a further unknown of an effect must bring.
PENALTY = 0.1
# Times the best misfit: further behind, a hypothesis does not go on; nearer, it always does. After
# the few iterations of the first pass, which do not reach a minimum yet, more is forgiven.
BEHIND, ABREAST, TRIAGED = 10.0, 3.0, 30.0
# Weighted squares per row beyond noise (half a per cent of the response): what leaves no more
# needs nothing else.
CLEAR = 0.25
# Level at which a fit that leaves more is begun a second time, from the nominal model.
AGAIN = 1
# Single effects beside which a second is sought; where the mesh alone may leave as much; of rigs.
PARENTS, FEW_PARENTS, RIG_PARENTS = 4, 2, 3
# Times the best single effect's misfit: further behind, none is tried as a first.
CLOSE = 4.0
# Seconds refitted that are carried on; best singles in whose place others are sought; exchanges of
# one effect of the best set; alternatives to an effect; sets of a reference that a rig completes.
PARTNERS, MOVES, ROUNDS, ALTERNATIVES, COMPLETED = 6, 2, 6, 6, 4
# Of a model that is far off: effects taken up beside each of so many sets (those of one type that
# share a node count once: a joint beside a fixture stood behind seven others), how many are kept;
# of what the bounded comparison leaves, the most that a further effect may leave: noise and scatter
# of the nuisance parameters make a few per cent of it.
# Each is begun at so many sizes, and with as many carried on: valleys lie side by side.
NEAREST, BEAM, NEARER, STARTS = 8, 3, 0.95, 2
# Times what the nearest set leaves: from one further behind, one effect more does not come abreast.
FALLEN = 3.0
# Part of the time for one diagnosis that growing them may take; a look at the reference, or at the
# modes in responses.
GROWING, LOOK = 0.5, 0.5
# Larger sets of elements tried in place of one that was found: the best, and one that ties.
WIDER = 2
# Best explanations in which stretches within elements are tried; how often, if they are better.
ZONED, STRETCHED = 2, 3
# Fixtures or cords on which a rig alone is tried: the nearest, and one on the other side of a tie.
MOUNTS = 2
# Effects in one hypothesis, at most; as many of a rig count among them as leave two to be sought.
MOST_EFFECTS, OF_A_RIG = 5, 3
# Times the best single effect's misfit: an effect that alone leaves more is nothing by itself.
ALONE = 100.0
# Measured figures beyond the nuisance parameters from which on a second effect is sought: with
# fewer, two effects fit nearly anything.
SPARE = 5

# ----------------------------------------------------------------------------------------- judge
# Weighted squares per row: within noise and model discrepancy; above, a model leaves something
# open; above, there is nothing to sharpen.
EXPLAINED, OPEN, HOPELESS = 1.0, 4.0, 10.0
# Level of chi-square at which what a table of modes leaves is chance: of all its figures; and its
# kinds (frequencies, shapes, damping ratios), each by itself, share as much again between them.
CHANCE = 0.99
# Level at which a held-out error agrees with its standard deviations.
LIKELY = 0.95
# A finding must halve the misfit beyond noise, and the held-out error of the model as it came.
HALVED = 0.5
# Of the held-out error with nuisance parameters alone, noise apart; times the noise: a held-out
# error that cannot become lower.
LOWER, MET = 0.7, 1.1
# Fall of Bayes' information criterion that is strong evidence (Kass and Raftery 1995); hypotheses
# nearer to one another are not told apart.
STRONG = 6.0
# Standard deviations that a size must be from nothing (of an oscillator: if a reference had its
# mode), from which on a group is off by more than scatter; part of a bound that is on it.
LEAST_SIZE, SEEN_SIZE, STRAINED, AT_BOUND = 2.0, 1.0, 3.0, 1e-3
# Relative error (responses, eigenvalues) above which even the best model leaves them unexplained;
# fraction of the nuisance parameters' misfit that an effect may leave that does not explain all.
UNEXPLAINED, CLEARLY = 0.1, 0.1
# Times its own mass that a part may have come to weigh between two tests: as much as a steel pipe
# of sixty wall thicknesses that was filled with water. More is put on at nodes.
HEAVIEST = 3.0
# Times what the mesh may leave: nothing below is taken for a second effect.
TWICE = 2.0
# Fall of a misfit that already counts as explained from which an effect is still believed.
LARGE = 4.0
# Probability from which on a finding is stated: its place is likelier than all others together.
# Below, findings are more often wrong than right (docs/calibration.md).
STATED = 0.5
# Most that is stated: one time in a hundred what is missing is nothing that was tried.
MOST_SURE = 0.99
# Most that is stated where time ended the search: what was not refitted to the end may be as likely
# as all that was.
CUT_SHORT = 0.5
# Probability from which on it is said what all likely hypotheses have in common; part of the
# structure's extent up to which they are at one place: an engineer looks there, and not everywhere.
GRADED, REGION = 0.8, 0.25
# Part of what is left that "mostly" means; of the band, or its logarithm, over which it is spread.
MOSTLY, SPREAD = 0.7, 0.5

# --------------------------------------------------------------------------- pattern of damping
# Fall of the squares of log damping ratios that chance gives one parameter once in 2000 times;
# probability that the best of an effect's places does as well where there is nothing.
DAMPING_GAIN, LUCK = 12.0, 0.002
# Measured damping ratios below which there is no pattern, and no law of all modes.
FEWEST_RATIOS, LAW_RATIOS = 4, 6
# Relative growth of the misfit that an effect of damping may cost.
DAMPING_COST = 1.05
# Deviation of log ζ of a mode by itself where one rate of decay is all the damping that there is:
# its own damping beside an exponential window, a tenth of it.
LAW_SCATTER = 0.1

# ------------------------------------------------------------------------- internal forces
# Times what the best place leaves when any force may act there: places further off are not tried;
# places tried at most: few sensors tell few places apart, and the one that acts may be twelfth.
LOCATED, MOST_PLACES = 5.0, 16
# Squared cosine of two places' deflections above which a law is tried at both (strain energy alike
# to a tenth), and move as one (deflections alike to a tenth); how many neighbours are refitted.
NEIGHBOURING, AS_ONE, NEIGHBOURS = 0.9, 0.99, 6
# Difference of log odds within which places that no recording tells apart are about as likely (e:
# nothing worth a mention; Kass and Raftery 1995), so that the one in the middle is named; and the
# confidence from which one place is twice as likely as all others, which the sentence leaves out.
AS_LIKELY, SURE_OF_PLACE = 1.0, 2.0 / 3.0
# How often the neighbours of the best place are tried, if one of them is then the best.
WALKS = 3
# Relative difference of predictions that advises no measurement: a sound model leaves as much.
TELLING = 0.03
# Relative error of a free simulation that leaves nothing to look for: where parts touch or slip the
# smallest differences grow, and the true law with scatter in all else leaves one to three per cent.
SIMULATED = 0.03
# Part of the recordings that a law must follow at least for their beginnings to be compared alone.
FOLLOWED = 0.25
# Seconds of computing (two processes do SHARED times as much meanwhile), and by the clock, after
# which a search begins nothing new: the rest takes ten more, so that two minutes are kept. Cut
# short it says less and errs more: a shared machine, which gives a third of itself, cuts none.
BUDGET, SHARED, WALL = 100.0, 1.4, 300.0
# Explanations that are refitted to the end even then: the best and what it is weighed against.
STAYING = 3
# Reversals of a part on a rig from which on their median says more than the law through them.
FEWEST_REVERSALS = 3
# Of a part on a rig: fraction of the error without free play that one must leave at most to be
# told; relative error of the force that spring and dashpot may leave where nothing else is sought
# (what load cells and their mountings scatter by).
PLAY_GAIN, RIG_SURE = 0.9, 0.05
# Likewise, of the error of one law for runs at several levels: coefficients of each level's own
# must leave half of its power at most, or the law is that of all levels.
OWN_GAIN = 0.7
# Deviations that tell two explanations apart for good: odds of exp(d²/2), a quarter of a million.
APART_ENOUGH = 5.0
# Responses that a plan proposes as a set: what an analyser with a force and four motions takes in
# one run, for a single one seldom tells; at most three such runs, or half an hour with a hammer. In
# between it ends where so many others are expected to be listed still (and so many more are as
# good), or no more lowers that.
FEWEST_TOGETHER, RESPONSES_TOGETHER, LEFT_ENOUGH, EVEN = 4, 12, 0.1, 0.1
# Known mass that a plan proposes to put on, part of the structure's: two to three per cent of the
# frequencies, which any test tells, and still a small change of the structure.
KNOWN_MASS = 0.05
# Known spring to ground that a plan proposes, part of the structure's mass times the square of its
# lowest natural frequency: where that mode moves most it raises its frequency by a tenth or more.
KNOWN_SPRING = 0.25
# Deviations below which two explanations are one and the same to a measurement.
UNTOLD = 1.0
