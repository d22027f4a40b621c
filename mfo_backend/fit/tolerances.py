# SPDX-License-Identifier: Apache-2.0
"""The numbers by which a fit decides what is noise, what can be seen and what is another material: one name a meaning.

Each says its unit, what turning it does, and the measurement that it rests on. How much a fit does is in `plans`.
A number that one file alone needs, and that decides nothing about a result, lies there.
"""

from __future__ import annotations

from ..metrics.responses.response import DIM_FLOOR as DIM_FLOOR

# ---- noise

# Relative error of a picture, also where a residual says 0: float32, quantisation, small differences of renderers.
# Larger: less is called determined, and weights look less at bright and clean tiles. Smaller: exact scenes call values
# determined that are off by what two renderers differ in. No measurement of its own; certainties with it are in
# docs/method/certainty.md (the table of what is promised and kept).
MODEL_ERROR = 0.002
# Root mean square residual in standard deviations of the noise: above, there is more than noise to explain, and
# perceptual stages run. 64 x 64 pixels under probes: 0.76 to 1.08 in 16 scenes whose material the model holds; above
# 1.1 in 5 of 12 measured materials, from which the stages take 0.004 of 0.075 FLIP (docs/notebook/ablations.md).
# Larger: they are left out of fits that could gain. Smaller: they fit noise and take three quarters of a fit's time.
AT_NOISE = 1.1
# Noise of a pixel relative to its radiance from which on FLIP is of blurred pictures. Larger: FLIP sees noise, which
# shifts the best values. Smaller: pictures without visible noise lose detail. No measurement.
NOISY = 0.02

# ---- what is sure (chi squared of one value is the square of its standard deviations)

# Chi squared by which a picture has to ask for a lobe that the user's material lacks: three standard deviations.
# Larger: weak lobes are lost. Smaller: noise switches lobes on. No measurement.
SIGNIFICANT = 9.0
# Chi squared above which another material is not looked at any more. In nine scenes that Cycles had rendered such
# differences were 2.6 to 17 standard deviations by the scatter between tiles, and smaller ones at most 2.3. Larger:
# more trials. Smaller: likely rivals are not named.
HOPELESS = 60.0
# Standard deviation, of the range of a value, below which it is called determined. Of a value that spans [0, 1] two
# such steps are hard to tell apart by eye. Two solved ends, which lie as near to their minimum as a solve comes, are
# one material unless they are further apart. Larger: more is promised than an eye would grant, and a rival is taken for
# the result itself. Smaller: the result is named as its own rival.
DETERMINED_BELOW = 0.02
# The same below which it is weak; above, the picture does not show it, and it goes back to the user's. Larger: values
# that only noise has chosen stay. Smaller: values that the picture shows go back. No measurement.
WEAK_BELOW = 0.15

# Standard deviations that are chance: they are taken from what neighbours share, a slope may be so much larger in
# truth, and a square that is not above so many of its own may be none. A lobe whose amount is no further from 0 may not
# be there, so that nothing is promised of its details: of 40 predictions in scenes 4 to 12 of `studies.views` two were
# of such ones, wrong by factors of 3.6 and 10.8 (docs/notebook/several_pictures.md). Larger: less is called different,
# and details are promised by fewer pictures. Smaller: what noise made is taken for real.
CHANCE = 2.0
# Of the box: the root mean square distance of a uniform distribution over it from one of its ends, which is the largest
# from any point. In 30 fits of Cycles' pictures 73 of 220 known values are called determined with it and 67 without,
# one of them wrongly in both (docs/notebook/several_pictures.md). Smaller: more is promised of what values trade.
BOX_SD = 3.0**-0.5

# Part of the tiles that alone say nothing against a material. In a picture by Cycles of 64 x 64 pixels one firefly of 8
# standard deviations asked for a black tint with a chi squared of 80; a coat's highlight under a sun fills more tiles.
# Larger: small highlights ask for nothing. Smaller: fireflies ask for lobes.
LOUDEST = 0.01

# ---- what can be seen

# Mean FLIP that a change may add and still count as unseen; values that the picture does not show change it by less
# than half of this. Larger: a visible difference is accepted. Smaller: undetermined values stay as noise has put them.
VISIBLE = 0.002
# Mean change of pixels, relative to them and to a hundredth of their median, that FLIP need not be asked about. Even
# where both pictures were equal, where FLIP is steepest, it then rises by 0.0013 at most
# (tests/fit/recorded/test_keep_user_values.py). Smaller: more pictures are computed.
UNSEEN_CHANGE = 5e-5

# ---- what costs no more (factors of a mean square residual)

# Up to it values go back to the user's. Larger: values go back that the picture tells a little of. No measurement.
AS_GOOD = 1.01
# Above it, on some of the groups, it is not tried on all of them. Larger: more time. Smaller: what all groups would
# allow is missed. No measurement.
NOT_AS_GOOD = 1.1
# Another basin is gone on with below it: it takes a new recording, and weights come from the solution it is compared
# with. Eight random materials: noise put the right basin second by 0.3 % of the cost (docs/notebook/recorded_paths.md).
# Larger: time for basins that noise prefers. Smaller: better ones are missed.
CLEARLY_LOWER = 0.97

# Of a value's range: a change, or a deviation along a direction, from which on a sentence names it. No measurement.
TELLING = 0.05

# ---- what is another material (of the box, in some value)

# Starts and solutions further apart are followed both. Larger: a second basin is taken for the first. Smaller: one
# basin is solved twice. No measurement.
ANOTHER_BASIN = 0.1
# Largest roughness of an end that is asked by a picture whether it is a mirror. Chrome of roughness 0 ended at 0.052 to
# 0.069 by Cycles' pictures of a ball and a head; pictures told 0.1 from none by two standard errors and more
# (docs/notebook/recorded_paths.md). Larger: a picture more of materials that are none. Smaller: chrome keeps a blur.
NEARLY_A_MIRROR = 0.1
# A value this near to its lower bound is switched off. Larger: weak lobes count as none. No measurement.
OFF = 0.002

# ---- several pictures

# Mean square of all pictures' residuals over that of the others where one is left out: from it on this one does not go
# with them. Seven scenes of Cycles with a moved lamp and 21 fits without are on the right sides of it
# (docs/notebook/several_pictures.md); how near to it was not read. Of two whose ratios differ by less both are named.
# Larger: a wrong picture is averaged in silence, and a right one is accused, too.
AGAINST_REST = 2.0
# A further picture is proposed where it divides a deviation by so much. Larger: fewer proposals. No measurement.
WORTH_A_PICTURE = 2.0
# Deviation, of the box, of a value that may lie anywhere in it: that of a uniform distribution.
NOTHING_KNOWN = BOX_SD / 2
