#!/usr/bin/env python3
"""Checks certificates of a strategy's cost over a log: python check_claim.py CLAIM.lios.zip... LOG.mcap...

Standard library and `mcap` only. Checked: every step can be done and costs what the log says; a look's answers are
all that a world which agrees with it can give; the ends are least and greatest. Not checked: the strategy's choices.
"""

import hashlib
import json
import sys
import zipfile
from collections import Counter
from copy import copy
from itertools import chain, combinations, product
from math import inf, isfinite, prod
from os.path import isdir, isfile

try:
    from mcap.reader import make_reader
except ImportError as error:
    print(f"logs cannot be read without the Python package mcap ({error}): pip install mcap", file=sys.stderr)
    sys.exit(2)

VERSION, NEAR, MAX_BYTES, MAX_ANSWERS = 1, 1e-6, 256_000_000, 64


class Refused(Exception):
    """What is wrong with a claim."""


def need(holds, what):
    if not holds:
        raise Refused("".join(c if c.isprintable() else "?" for c in what))


def same(a, b):
    return type(a) in (int, float) and type(b) in (int, float) and abs(a - b) <= NEAR


class Log:
    """The facts of a log: the map, the costs, the task, and what each opened container held at the start."""

    def __init__(self, path):
        with open(path, "rb") as stream:
            self.sha256 = hashlib.sha256(stream.read()).hexdigest()
            stream.seek(0)
            reader = make_reader(stream)
            parts = {a.name: json.loads(a.data) for a in reader.iter_attachments() if a.name.endswith(".json")}
            heard = {topic: [] for topic in ("/search/observation", "/search/action", "/search/outcome")}
            for _, channel, message in reader.iter_messages(topics=list(heard)):
                heard[channel.topic].append(json.loads(message.data))
        place, self.task, self.costs = parts["place.json"], parts["task.json"], parts["settings.json"]["costs"]
        self.index = {name: i for i, name in enumerate(place["travel"]["locations"])}
        self.rows, self.symmetric = place["travel"]["metres"], place["travel"].get("symmetric", False)
        self.goal, self.failure = self.task["goal"], self.task["failure_cost"]
        actions = heard["/search/action"]
        indexes, one_end = sorted(a["index"] for a in actions), len(heard["/search/outcome"]) == 1
        whole = one_end and indexes == [*range(1, len(actions) + 1)] and all(a["success"] for a in actions)
        need(whole, "the log is not whole, or shows refused actions")
        looks = sorted(heard["/search/observation"], key=lambda o: (stamp(o), o["decision"]))
        containers = [c["id"] for c in place["plan"]["containers"]]
        self.contents = contents_at_start(looks, actions, containers)
        self.known = {o["container"] for o in looks if o["known_at_start"]}
        self.open = {c for c in containers if c not in self.contents and c in self.index}
        self.hidden = any(c not in self.contents and c not in self.open for c in containers)
        self.seen = {t for items in self.contents.values() for t in items.values()}

    def metres(self, a, b):
        i, j = self.index[a], self.index[b]
        return self.rows[max(i, j)][min(i, j)] if self.symmetric else self.rows[i][j]


def stamp(event):
    return event["stamp"]["sec"] * 1_000_000_000 + event["stamp"]["nsec"]


def contents_at_start(looks, actions, containers):
    """Per opened container, what stood there before the robot moved anything: id to type. Any look may show it."""
    home, contents, moved = {}, {}, [a for a in actions if a["action"] in ("pick", "place")]
    handled = {item: stamp(a) for a in sorted(moved, key=stamp, reverse=True) for item in a["items"]}
    for look in looks:
        container, found = look["container"], {}
        need(container in containers, f"the log shows {container}, which its map does not have")
        need(look.get("support", "") != "imputed", "the log is of an imagined world")
        for item in look["items"]:
            carried = handled.get(item["id"], inf) <= stamp(look)
            if home.setdefault(item["id"], "" if carried else container) == container:
                found[item["id"]] = item["type"]
        contents.setdefault(container, {}).update(found)  # what a later look shows, an earlier one missed
    return contents


def parts_of(goal):
    if goal["goal"] in ("all-of", "any-of"):
        return [want for part in goal["parts"] for want in parts_of(part)]
    need(goal["goal"] in ("delivered", "holding") and not goal.get("properties"), "a goal that is not known here")
    return [goal]


def demand(goal):
    """How many instances of each type one way of meeting the goal can use."""
    if goal["goal"] == "all-of":
        return sum((demand(part) for part in goal["parts"]), Counter())
    if goal["goal"] == "any-of":
        ways = [demand(part) for part in goal["parts"]]
        return Counter({t: max(way[t] for way in ways) for t in chain(*ways)})
    return Counter([goal["item_type"]])


def fits(wants, used=frozenset()):
    return not wants or any(i not in used and fits(wants[1:], used | {i}) for i in wants[0])


class State:
    """Where the robot is, what it holds, where the items that it knows of stand, and what it opened."""

    def __init__(self, log):
        self.at, self.held, self.spent, self.world, self.opened = "start", None, 0.0, {}, set(log.known)
        self.items = {i: (t, c) for c in log.known for i, t in log.contents[c].items()}

    def again(self):
        other = copy(self)
        other.world, other.opened, other.items = dict(self.world), set(self.opened), dict(self.items)
        return other

    def candidates(self, want):
        if want["goal"] == "holding":
            return [self.held] * (self.at == want["at"] and self.items.get(self.held, "??")[0] == want["item_type"])
        return [i for i, (t, p) in self.items.items() if (t, p) == (want["item_type"], want["at"])]

    def ways(self, goal):
        if goal["goal"] == "any-of":
            return [way for part in goal["parts"] for way in self.ways(part)]
        if goal["goal"] == "all-of":
            return [list(chain(*ways)) for ways in product(*(self.ways(part) for part in goal["parts"]))]
        return [[self.candidates(goal)]]

    def met(self, goal):
        return any(fits(way) for way in self.ways(goal))

    def do(self, step, log):
        """Takes a step if it can be taken, and checks what it costs."""
        action, target, items = step["action"], step["target"], step["items"]
        need(step["origin"] == self.at, f"a step from {step['origin']} while the robot stands at {self.at}")
        if action == "move":
            cost, self.at = log.metres(self.at, target), target
        else:
            need(target == self.at, f"{action} at {target} while the robot stands at {self.at}")
            cost = log.costs["search" if action == "search" else "manipulation"]
        need({"move": 0, "search": 0, "pick": 1, "place": 1}.get(action) == len(items), f"{action} of {items}")
        if action in ("pick", "place"):
            item = items[0]
            free = self.held is None and self.items.get(item, "??")[1] == self.at
            need(free if action == "pick" else self.held == item, f"{action} of {item}, not to hand at {self.at}")
            self.held = item if action == "pick" else None
            self.items[item] = (self.items[item][0], None if action == "pick" else self.at)
        elif action == "search":
            need(target in log.contents and target not in self.opened, f"a look into {target}, which the log lacks")
            self.opened.add(target)
            self.items |= {i: (t, target) for i, t in log.contents[target].items() if i not in self.items}
        need(same(step["cost"], cost), f"{action} to {target} costs {cost}, not {step['cost']}")
        self.spent += cost


class Check:  # one claim against its log
    def __init__(self, claim, log):
        self.claim, self.log, self.ends, self.demand = claim, log, [], demand(log.goal)
        wants, parts = parts_of(log.goal), log.goal.get("parts", [log.goal])
        plain = log.goal["goal"] != "any-of" and all(p["goal"] == "delivered" for p in parts)
        listed = set(log.task.get("available") or [])
        self.finishing = {}
        for want in wants if plain else []:
            self.finishing.setdefault(want["item_type"], {"goal": "all-of", "parts": []})["parts"].append(want)
        self.types, self.must_exist = claim["types"], set(claim["types"]) & listed
        need(self.types == sorted(set(self.types)), "types are not sorted, or double")
        possible = {w["item_type"] for w in wants if not listed or w["item_type"] in listed | log.seen}
        somewhere = not listed or set(self.types) <= listed | log.seen
        need(somewhere and possible <= set(self.types), "types that matter are left out, or are nowhere")

    def run(self):
        need(same(self.claim["failure_cost"], self.log.failure), f"a failure costs {self.log.failure}")
        self.node(self.claim["tree"], State(self.log))
        for name, pick, end in (("lower", min, 0), ("upper", max, 1)):
            bound, cost = self.claim[name], pick(e[end] for e in self.ends)
            worlds = [e[2] for e in self.ends if e[2] is not None and isfinite(cost) and same(e[end], cost)]
            need(bound["kind"] == ("leaf" if worlds else "outer"), f"{name} is no {bound['kind']}")
            need(bound["cost"] is None if cost == inf else same(bound["cost"], cost), f"{name} is {cost}")
            need(bound["world"] in worlds if worlds else bound["world"] is None, f"no run has the world of {name}")
        return self.claim["lower"]["cost"], self.claim["upper"]["cost"]

    def node(self, node, state):
        one = len([k for k in ("look", "end", "outer") if node.get(k)]) == 1
        need(one and set(node) <= {"steps", "look", "end", "outer"}, "a branch without one end, or with more in it")
        need(not (node.get("outer") and node.get("steps")), "steps before an outer bound")
        for step in node.get("steps", []):
            state.do(step, self.log)
        if node.get("outer"):
            self.outer(node["outer"], state)
        elif node.get("look"):
            self.look(node["look"], state)
        else:
            done, charged = node["end"]["done"], node["end"]["charged"]
            cost = state.spent if done else self.log.failure
            need(done is state.met(self.log.goal) and same(charged, cost), f"a run ends otherwise: {node['end']}")
            self.ends.append((cost, cost, state.world))

    def outer(self, outer, state):
        """Nothing is known of a branch but that what was spent was spent, unless the run fails."""
        least = min(state.spent, self.log.failure)
        need(same(outer["least"], least), f"an outer bound of {outer['least']}, not {least}")
        self.ends.append((least, inf, None))

    def look(self, look, state):
        container = look["container"]
        fresh = container in self.log.open and container not in state.opened
        need(fresh and state.at == container, f"{container} cannot be opened anew from {state.at}")
        need(same(look["cost"], self.log.costs["search"]), f"a look costs {self.log.costs['search']}")
        live = [t for t in self.types if not (t in self.finishing and state.met(self.finishing[t]))]
        need(look["live"] == live, f"of {container} matter {live}")
        possible, all_listed = self.answers(live, state, container)
        given = [tuple(item["type"] for item in a["items"]) for a in look["answers"]]
        distinct = len(set(given)) == len(given) and set(given) <= possible
        complete = not all_listed if look.get("others") else set(given) == possible
        need(distinct and complete, f"the answers of {container} are not all that there are")
        state.spent += look["cost"]
        state.opened.add(container)
        if look.get("others"):
            self.outer(look["others"], state)
        for answer in look["answers"]:
            after = state.again()
            ids = [item["id"] for item in answer["items"]]
            need(len(set(ids)) == len(ids) and not set(ids) & set(after.items), "an item twice")
            need(all(i.split("|")[1:-1] == ["imputed", *container.split("|")] for i in ids), "an item of elsewhere")
            after.items |= {item["id"]: (item["type"], container) for item in answer["items"]}
            after.world[container] = [item["type"] for item in answer["items"]]
            self.node(answer["then"], after)

    def answers(self, live, state, container):
        """All that a container can hold, of what matters, and agree with the log; and whether all must be listed."""
        found = {t for types in state.world.values() for t in types}
        last = self.log.open - state.opened == {container} and not self.log.hidden
        sure = self.must_exist - self.log.seen - found if last else set()
        ranges = [range(int(t in sure), max(1, self.demand[t]) + 1) for t in live]
        count = prod(len(numbers) for numbers in ranges)
        need(count <= 1_000_000, "more answers than can be counted")
        answers = {tuple(t for t, n in zip(live, ns, strict=True) for _ in range(n)) for ns in product(*ranges)}
        return answers, count <= MAX_ANSWERS


def seal_of(claim):
    rest = {name: value for name, value in claim.items() if name != "seal"}
    return hashlib.sha256(json.dumps(rest, sort_keys=True, separators=(",", ":")).encode()).hexdigest()


def check(claim, logs):
    """The bounds that a claim shows; raises Refused. logs: by hash."""
    try:
        need(claim["version"] == VERSION, f"it is of version {claim['version']}; this checker knows {VERSION}")
        need(claim.get("seal") == seal_of(claim), "its seal is broken: it was changed after it was made")
        log = logs.get(claim["log_sha256"])
        need(log is not None, f"no log here is the one that it is about ({claim['log']})")
        return Check(claim, log).run()
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError) as error:
        raise Refused(f"it is not formed as a claim ({type(error).__name__}: {error})") from None


def main(paths):
    wrong = [f"{path}: {'it is a folder' if isdir(path) else 'no such file'}" for path in paths if not isfile(path)]
    if wrong or all(path.endswith(".mcap") for path in paths):
        print((wrong or ["no claim is given: check_claim.py CLAIM.lios.zip... LOG.mcap..."])[0], file=sys.stderr)
        return 2
    code, by_strategy, logs = 0, {}, {}
    for path in sorted(paths, key=lambda p: not p.endswith(".mcap")):
        try:
            if path.endswith(".mcap"):
                logs |= {log.sha256: log for log in [Log(path)]}
                continue
            with zipfile.ZipFile(path) as packed:
                need(packed.getinfo("claim.json").file_size <= MAX_BYTES, "it is too large")
                claim = json.loads(packed.read("claim.json"))
            (lower, upper), log_hash = check(claim, logs), claim["log_sha256"]
            need(claim["strategy"].isprintable(), "its strategy has a name that cannot be printed")
            most = "no upper bound" if upper is None else f"{upper:.2f} ({claim['upper']['kind']})"
            by_strategy.setdefault(claim["strategy"], {})[log_hash] = lower, inf if upper is None else upper
            print(f"{path}: holds: {claim['strategy']} costs {lower:.2f} ({claim['lower']['kind']}) to {most}")
        except Exception as error:  # noqa: BLE001 - damaged bytes raise whatever decompressors raise
            why = error if isinstance(error, Refused) else f"it cannot be read ({type(error).__name__}: {error})"
            print(f"{path}: refused: {why}")
            code = 1
    for (a, ours), (b, theirs) in combinations(by_strategy.items(), 2):
        if n := len(both := ours.keys() & theirs.keys()):
            low, high, least, most = (sum(side[k][end] for k in both) for side in (ours, theirs) for end in (0, 1))
            neither = f"neither of {a} and {b} is shown to beat the other"
            beats = f"{a} beats {b}" if high < least - NEAR else f"{b} beats {a}" if most < low - NEAR else neither
            print(f"{beats} on {n} trial{'s in sum' * (n > 1)}, in every world that agrees with the logs")
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
