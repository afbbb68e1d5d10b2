#!/usr/bin/env bash
# pomdp-py 1.3.5.1: in its object search, a false sighting counts 1,600 times too much, and looks again hardly undo it.
#
# Expected: the observation model of multi_object_search (Wandzel and others, ICRA 2019: with probability epsilon the sensor is
#   right, else it sees the object anywhere or nowhere) samples observations and gives their probabilities, of one law: over
#   all observations of a look they sum to 1, and a belief updated by them is Bayes' rule.
# What happens: an observation is a cell of the grid, and its probability is taken to be the density of a Gaussian there: with
#   the default sigma of 0.01 cells, 1,592 instead of 1. One look's probabilities sum to 1,433. A look that sees nothing is
#   counted right. After one sighting and two looks at the same cell that see nothing, the belief in that cell is 94 %
#   where the sampler's own law says 8 %. With epsilon 1, as the examples have it, nothing shows.
# Who is hurt: whoever takes this model, or its pattern (a density for a discrete observation), for search with a detector that
#   errs: the robot returns to where it was mistaken. Dividing by the Gaussian's sum over the cells repairs it.
# Seen 2026-11-30. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pomdp-py==1.3.5.1 numpy==2.4.6 scipy==1.17.1
cd "$folder"
cat > show.py <<'PY'
import random

from pomdp_py import Histogram, update_histogram_belief
from pomdp_py.problems.multi_object_search.domain.action import Look
from pomdp_py.problems.multi_object_search.domain.observation import ObjectObservation
from pomdp_py.problems.multi_object_search.domain.state import MosOOState, ObjectState, RobotState
from pomdp_py.problems.multi_object_search.models.components.sensor import Laser2DSensor
from pomdp_py.problems.multi_object_search.models.observation_model import ObjectObservationModel

SIZE, ROBOT, MUG, EPSILON, SAMPLES = 10, -1, 0, 0.9, 100_000
NOTHING = ObjectObservation.NULL
sensor = Laser2DSensor(ROBOT, fov=90, min_range=1, max_range=5, angle_increment=0.5)
model = ObjectObservationModel(MUG, sensor, (SIZE, SIZE), epsilon=EPSILON, sigma=0.01)
robot = RobotState(ROBOT, (0, 5, 0.0), (), None)
cells = [(x, y) for x in range(SIZE) for y in range(SIZE)]
everything = [NOTHING, *((x, y) for x in range(SIZE + 1) for y in range(SIZE + 1))]  # what the sampler can give
ahead, behind = (3, 5), (9, 9)


def state(cell):
    return MosOOState({MUG: ObjectState(MUG, "target", cell), ROBOT: robot})


def probability(seen, cell):
    return model.probability(ObjectObservation(MUG, seen), state(cell), Look)


random.seed(1)
for name, cell in (("in view", ahead), ("out of view", behind)):
    sampled = [model.sample(state(cell), Look).pose for _ in range(SAMPLES)]
    print(f"mug {name}: probabilities sum to {sum(probability(seen, cell) for seen in everything):.0f};", end=" ")
    for what, seen in (("its cell", cell), ("nothing", NOTHING)):
        print(f"{what} {probability(seen, cell):.2f}, sampled {sampled.count(seen) / SAMPLES:.2f}", end="; ")
    print()


def by_the_sampler(seen, cell):
    """The law by which the model samples: right, anywhere at all, or nothing."""
    right, anywhere, nothing = model._compute_params(sensor.within_range((0, 5, 0.0), cell))
    return nothing if seen == NOTHING else anywhere / (SIZE + 1) ** 2 + (right if seen == cell else 0)


belief = Histogram({ObjectState(MUG, "target", cell): 1 / len(cells) for cell in cells})
bayes = dict.fromkeys(cells, 1 / len(cells))
for number, seen in enumerate([ahead, NOTHING, NOTHING, NOTHING]):
    observation = ObjectObservation(MUG, seen)
    given = {"static_transition": True, "oargs": {"next_robot_state": robot}}
    belief = update_histogram_belief(belief, Look, observation, model, None, **given)
    weighed = {cell: share * by_the_sampler(seen, cell) for cell, share in bayes.items()}
    bayes = {cell: weight / sum(weighed.values()) for cell, weight in weighed.items()}
    words = f"seen once, then nothing {number} times"
    print(f"{words}: belief {belief[ObjectState(MUG, 'target', ahead)]:.2f}, by the sampler's law {bayes[ahead]:.2f}")
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "mug in view: probabilities sum to 1433; its cell 1432.40, sampled 0.90; nothing 0.05, sampled 0.05; 
mug out of view: probabilities sum to 81; its cell 79.58, sampled 0.05; nothing 0.90, sampled 0.90; 
seen once, then nothing 0 times: belief 1.00, by the sampler's law 0.96
seen once, then nothing 1 times: belief 1.00, by the sampler's law 0.61
seen once, then nothing 2 times: belief 0.94, by the sampler's law 0.08
seen once, then nothing 3 times: belief 0.50, by the sampler's law 0.00" ]
