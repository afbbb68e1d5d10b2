#!/usr/bin/env python3
"""Checks certificates of a strategy's cost over a log: python check_claim.py CLAIM.lios.zip... LOG.mcap...

Standard library and `mcap` only. Checked: each step can be done and costs what the log says; a look has all answers
that agree with it; the ends are least and greatest. Not checked: the strategy's choices (docs/certificates.md).
"""

import hashlib
import json
import sys
import zipfile
from collections import Counter
from copy import deepcopy
from itertools import chain, combinations, product
from math import inf, prod
from os.path import basename, isdir, isfile

try:
    from mcap.reader import make_reader
except ImportError as error:
    print(f"logs cannot be read without the Python package mcap ({error}): pip install mcap", file=sys.stderr)
    sys.exit(2)

VERSION, NEAR, MAX_BYTES, MAX_ANSWERS, MAX_PAIRS = 2, 1e-6, 256_000_000, 64, 1_000_000


class Refused(Exception):
    """What is wrong with a claim."""


def need(holds, what):
    if not holds:
        raise Refused("".join(c if c.isprintable() else "?" for c in what))


def same(a, b):
    return type(a) in (int, float) and type(b) in (int, float) and abs(a - b) <= NEAR


class Log:  # the facts of a log: the map, the costs, the task, and what each opened container held at the start
    def __init__(self, path):
        with open(path, "rb") as stream:
            self.sha256 = hashlib.sha256(stream.read()).hexdigest()
            self.name = f"{basename(path)} {self.sha256[:8]}"
            stream.seek(0)
            reader = make_reader(stream)
            parts = {a.name: json.loads(a.data) for a in reader.iter_attachments() if a.name.endswith(".json")}
            heard = {topic: [] for topic in ("/search/observation", "/search/action", "/search/outcome")}
            for _, channel, message in reader.iter_messages(topics=list(heard)):
                heard[channel.topic].append(event := json.loads(message.data))
                event["at"] = event["stamp"]["sec"] * 1_000_000_000 + event["stamp"]["nsec"]
        place, self.task, self.costs = parts["place.json"], parts["task.json"], parts["settings.json"]["costs"]
        travel, self.goal, self.failure = place["travel"], self.task["goal"], self.task["failure_cost"]
        self.index = {name: i for i, name in enumerate(travel["locations"])}
        self.metres, self.symmetric = travel["metres"], travel.get("symmetric", False)  # symmetric: the lower half
        actions, end = heard["/search/action"], len(heard["/search/outcome"]) == 1
        whole = end and sorted(a["index"] for a in actions) == [*range(1, len(actions) + 1)]
        need(whole and all(a["success"] for a in actions), "the log is not whole, or shows refused actions")
        looks = sorted(heard["/search/observation"], key=lambda o: (o["at"], o["decision"]))
        containers = [c["id"] for c in place["plan"]["containers"]]
        home, self.contents, moved = {}, {}, [a for a in actions if a["action"] in ("pick", "place")]
        handled = {item: a["at"] for a in sorted(moved, key=lambda a: -a["at"]) for item in a["items"]}
        for look in looks:
            container, found = look["container"], {}
            need(container in containers, f"the log shows {container}, which its map does not have")
            need(look.get("support", "") != "imputed", "the log is of an imagined world")
            for item in look["items"]:
                carried = handled.get(item["id"], inf) <= look["at"]
                if home.setdefault(item["id"], "" if carried else container) == container:
                    found[item["id"]] = item["type"]
            self.contents.setdefault(container, {}).update(found)  # what a later look shows, an earlier one missed
        self.known = {o["container"] for o in looks if o["known_at_start"]}
        self.open = {c for c in containers if c not in self.contents and c in self.index}
        self.hidden = any(c not in self.contents and c not in self.open for c in containers)
        self.seen = {t for items in self.contents.values() for t in items.values()}


def ways(goal):  # the lists of single wants that each meet a goal
    if goal["goal"] == "any-of":
        return [way for part in goal["parts"] for way in ways(part)]
    if goal["goal"] == "all-of":
        return [list(chain(*parts)) for parts in product(*(ways(part) for part in goal["parts"]))]
    need(goal["goal"] in ("delivered", "holding") and not goal.get("properties"), "a goal that is not known here")
    return [[goal]]


class State:  # where the robot is, what it holds, where the items that it knows of stand, and what it opened
    def __init__(self, log):
        self.at, self.held, self.spent, self.found, self.world = "start", None, 0.0, set(), {}
        self.opened = set(log.known)
        self.items = {i: (t, c) for c in log.known for i, t in log.contents[c].items()}

    def met(self, ways):
        there = Counter((t, "delivered", place) for t, place in self.items.values())
        there[self.items.get(self.held, [None])[0], "holding", self.at] = 1
        return any(not Counter((w["item_type"], w["goal"], w["at"]) for w in way) - there for way in ways)

    def do(self, step, log):  # takes a step if it can be taken, and checks what it costs
        action, target, items = step["action"], step["target"], step["items"]
        here = step["origin"] == self.at and (action == "move" or target == self.at)
        need(here, f"{action} from {step['origin']} to {target} while the robot stands at {self.at}")
        if action == "move":
            i, j = log.index[self.at], log.index[target]
            cost, self.at = log.metres[max(i, j) if log.symmetric else i][min(i, j) if log.symmetric else j], target
        else:
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


class Check:  # one claim against its log; ends: per branch the least and the most that it costs, and its answers
    def __init__(self, claim, log):
        self.log, self.ends, self.ways, self.types, self.shared = log, [], ways(log.goal), claim["types"], {}
        self.used, counts = Counter(), [Counter(want["item_type"] for want in way) for way in self.ways]
        self.demand = Counter({t: max(count[t] for count in counts) for t in chain(*counts)})
        plain = {part["goal"] for part in log.goal.get("parts", [log.goal])} == {"delivered"}
        done = self.ways[0] if plain and log.goal["goal"] != "any-of" else []
        self.finishing = {t: [want for want in done if want["item_type"] == t] for t in self.demand if done}
        listed, seen = set(log.task.get("available") or []), log.seen
        self.sure, there = listed & {*self.types} - seen, listed | seen if listed else {*self.types, *self.demand}
        need(self.types == sorted(set(self.types)), "types are not sorted, or double")
        need(there & {*self.demand} <= {*self.types} <= there, "types that matter are left out, or are nowhere")
        need(same(claim["failure_cost"], fail := log.failure), f"a failure costs {fail}")
        self.node(claim["tree"], State(log))
        need(self.used == {i: e[-1]["times"] for i, e in self.shared.items()}, "a branch goes on as none does")
        self.ends = [(min(a, fail) if f else a, max(b, fail) if f else b, w) for a, b, f, w in self.ends]
        for name, pick, end in (("lower", min, 0), ("upper", max, 1)):
            bound, cost = claim[name], pick(e[end] for e in self.ends)
            need(bound["cost"] is None if cost == inf else same(bound["cost"], cost), f"{name} is {cost}")
            if (bound["kind"], bound["path"], bound["world"]) != ("outer", None, None):
                ended = bound["kind"] == "leaf" and self.cost_in([*bound["path"]], {**bound["world"]}, claim["tree"])
                need(same(ended, cost), f"no run ends with {name}, {cost}, in its world")

    def cost_in(self, path, world, node, spent=0.0):  # the cost of the run that gets these answers, by their numbers
        node = self.shared[node["same"]][-1] if "same" in node else node
        spent += sum(step["cost"] for step in node.get("steps", []))
        if "end" in node and not world and not path:
            return spent if node["end"]["done"] else self.log.failure
        answer = dict(enumerate(node["look"]["answers"]))[path.pop(0)]  # no answer has a number below 0
        need([item["type"] for item in answer["items"]] == world.pop(node["look"]["container"]), "another world")
        return self.cost_in(path, world, answer["then"], spent + node["look"]["cost"])

    def live(self, state):
        return [t for t in self.types if not (t in self.finishing and state.met([self.finishing[t]]))]

    def forget(self, state, needs):  # what a run goes on from that needs some items, and others where they are wanted
        wanted = {(want["item_type"], want["at"]) for way in self.ways for want in way}
        items = {i: there for i, there in state.items.items() if i in needs or i == state.held}
        rest = Counter(state.items[i] for i in state.items.keys() - items.keys() if state.items[i] in wanted)
        state.items = items | {f"{there}|{n}": there for there in rest for n in range(rest[there])}
        sure = self.sure & state.found & {*self.live(state)}
        return deepcopy((state.at, state.held, state.opened, state.items, sure))

    def node(self, node, state):
        spent, start = state.spent, len(self.ends)
        if "same" in node:
            like, before, low, high, fails, other = self.shared[node["same"]]
            need(set(node) == {"same"} and self.forget(state, other["needs"]) == like, "a branch goes on otherwise")
            self.used[node["same"]] += 1
            self.ends.append((low + spent - before, high + spent - before, fails, state.world))
            return
        plain = {*node} - {"steps", "id", "needs", "times"} in ({"look"}, {"end"}) or {*node} == {"outer"}
        need(plain, "a branch without one end, or with more in it")
        begun = self.forget(state, node["needs"]) if "id" in node else None
        for step in node.get("steps", []):
            state.do(step, self.log)
        if "outer" in node:
            self.outer(node["outer"], state)
        elif "look" in node:
            self.look(node["look"], state)
        else:
            done, charged = state.met(self.ways), state.spent if state.met(self.ways) else self.log.failure
            need(node["end"]["done"] is done and same(node["end"]["charged"], charged), "a run ends otherwise")
            self.ends.append((state.spent if done else inf, state.spent if done else -inf, not done, state.world))
        if begun:
            low, high, fails, _ = zip(*self.ends[start:], strict=True)
            need(node["id"] not in self.shared, "two branches of one name")
            self.shared[node["id"]] = begun, spent, min(low), max(high), any(fails), node

    def outer(self, outer, state):  # nothing is known but that what was spent was spent, unless the run fails
        least = min(state.spent, self.log.failure)
        need(same(outer["least"], least), f"an outer bound of {outer['least']}, not {least}")
        self.ends.append((state.spent, inf, True, state.world))

    def look(self, look, state):
        container = look["container"]
        fresh = state.at == container and container in self.log.open - state.opened
        need(fresh, f"{container} cannot be opened anew from {state.at}")
        need(same(look["cost"], self.log.costs["search"]), f"a look costs {self.log.costs['search']}")
        live = self.live(state)
        need(look["live"] == live, f"of {container} matter {live}")
        last = self.log.open - state.opened == {container} and not self.log.hidden
        sure = self.sure - state.found if last else set()
        ranges = [range(int(t in sure), max(1, self.demand[t]) + 1) for t in live]
        count = prod(len(numbers) for numbers in ranges)
        need(count <= 1_000_000, "more answers than can be counted")
        possible = {tuple(t for t, n in zip(live, ns, strict=True) for _ in range(n)) for ns in product(*ranges)}
        given = Counter(tuple(item["type"] for item in a["items"]) for a in look["answers"])
        whole = given.keys() <= possible if look.get("others") and count > MAX_ANSWERS else given.keys() == possible
        need(whole and set(given.values()) <= {1}, f"the answers of {container} are not all that there are")
        state.spent += look["cost"]
        state.opened.add(container)
        if look.get("others"):
            self.outer(look["others"], state)
        for answer in look["answers"]:
            after = deepcopy(state)
            ids = [item["id"] for item in answer["items"]]
            need(len(set(ids)) == len(ids) and not set(ids) & set(after.items), "an item twice")
            need(all(i.split("|")[1:-1] == ["imputed", *container.split("|")] for i in ids), "an item of elsewhere")
            after.items |= {item["id"]: (item["type"], container) for item in answer["items"]}
            after.world[container] = live, [item["type"] for item in answer["items"]]
            after.found |= {*after.world[container][1]}
            self.node(answer["then"], after)


def check(claim, logs):  # the bounds that a claim shows, its ends, and who it is about; logs: by hash
    try:
        version = claim["version"]
        need(type(version) is int and version == VERSION, f"it is of version {version}; this checker knows {VERSION}")
        rest = json.dumps({k: claim[k] for k in claim if k != "seal"}, sort_keys=True, separators=(",", ":"))
        seal = hashlib.sha256(rest.encode()).hexdigest()
        need(claim.get("seal") == seal, "its seal is broken: it was changed after it was made")
        who = f"{claim['strategy']} ({claim['strategy_version']}, {claim['estimator']})"
        need(who.isprintable(), "its strategy has a name that cannot be printed")
        log = logs.get(claim["log_sha256"])
        need(log is not None, f"no log here is the one that it is about ({claim['log']})")
        return claim["lower"]["cost"], claim["upper"]["cost"], Check(claim, log).ends, who
    except (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError) as error:
        raise Refused(f"it is not formed as a claim ({type(error).__name__}: {error})") from None


def least_gap(ours, theirs):  # the least by which theirs can cost more in the same world: over all ends that agree
    least, pairs, theirs = inf, 0, sorted(theirs, key=lambda end: end[0])
    for _, most, world in sorted(ours, key=lambda end: -end[1]):
        for low, _, other in theirs:
            pairs += 1
            both = ((c, t) for c in world.keys() & other.keys() for t in world[c][0] if t in other[c][0])
            alike = all(world[c][1].count(t) == other[c][1].count(t) for c, t in both)
            if alike or low - most >= least or pairs > MAX_PAIRS:
                least = min(least, low - most)
                break
    return least


def main(paths):
    wrong = [f"{path}: {'it is a folder' if isdir(path) else 'no such file'}" for path in paths if not isfile(path)]
    if wrong or all(path.endswith(".mcap") for path in paths):
        print((wrong or ["no claim is given: check_claim.py CLAIM.lios.zip... LOG.mcap..."])[0], file=sys.stderr)
        return 2
    held, clash, logs, spoiled = {}, [], {}, set()
    for path in sorted(dict.fromkeys(paths), key=lambda p: not p.endswith(".mcap")):
        claim = None
        try:
            if path.endswith(".mcap"):
                logs |= {log.sha256: log for log in [Log(path)]}
                continue
            with zipfile.ZipFile(path) as packed:
                need(packed.getinfo("claim.json").file_size <= MAX_BYTES, "it is too large")
                claim = json.loads(packed.read("claim.json"))
            lower, upper, ends, who = check(claim, logs)
            mine = held.setdefault(who, {}).setdefault(claim["log_sha256"], [])
            for other, theirs in mine:
                alike = max(least_gap(ends, theirs), least_gap(theirs, ends)) <= NEAR
                clash += [mine] * (not alike)
                need(alike, f"no world agrees with it and with {other}, so that neither counts")
            mine.append((path, ends))
            most = "no upper bound" if upper is None else f"{upper:.2f} ({claim['upper']['kind']})"
            print(f"{path}: holds: {who} costs {lower:.2f} ({claim['lower']['kind']}) to {most}")
        except Exception as error:  # noqa: BLE001 - damaged bytes raise whatever decompressors raise
            why = error if isinstance(error, Refused) else f"it cannot be read ({type(error).__name__}: {error})"
            print(f"{path}: refused: {why}")
            spoiled.add(str(claim["log_sha256"]) if isinstance(claim, dict) and "log_sha256" in claim else "")
    for mine in clash:
        mine.clear()
    for a, b in combinations(held, 2):
        both = [k for k in logs if held[a].get(k) and held[b].get(k)]
        out = [log.name + " (a certificate was refused)" * (k in spoiled) for k, log in logs.items() if k not in both]
        said = f"neither of {a} and {b} is shown to beat the other"
        for one, other in ((a, b), (b, a)):
            gap = sum(max(least_gap(x, y) for _, x in held[one][k] for _, y in held[other][k]) for k in both)
            said = f"{one} beats {other} by {gap:.2f} or more" if gap > NEAR else said
        said += f" on {len(both)} trial{'s in sum' * (len(both) > 1)}, in every world that agrees with the logs: "
        said = said + ", ".join(logs[k].name for k in both) if both else f"{a} and {b} have no trial in common"
        print(said + (f"; left out, for lack of a certificate of both: {', '.join(out)}" if out else ""))
    return int(bool(spoiled))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
