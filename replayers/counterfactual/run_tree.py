"""The tree of a strategy's runs over every world that is consistent with a log, expanded lazily.

A node is what the robot knows; from it the ordinary closed loop runs on until the robot looks into a container that
nobody opened. There the tree branches: one child for every answer that the container can give. Histories that leave
the robot with the same knowledge of what still matters share a node (for strategies known to decide by that alone),
so that the tree is a graph and stays small. A strategy must be deterministic: the same view, the same decision.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from dataclasses import replace
from types import MappingProxyType
from typing import final

from replayers.counterfactual.decisions.another_instance import AnotherInstance
from replayers.counterfactual.decisions.decided import Asked, Decided
from replayers.counterfactual.decisions.memoized_strategy import DecisionBasis, MemoizedStrategy, StateKey
from replayers.counterfactual.decisions.needed_items import needed_items
from replayers.counterfactual.decisions.same_decision import SameDecision
from replayers.counterfactual.evidence import Evidence, is_plain
from replayers.counterfactual.logged_belief import with_beliefs
from replayers.counterfactual.logged_world import LoggedWorld
from replayers.counterfactual.overlooked import may_be_sighted, possible_contents
from replayers.counterfactual.relevance import Answer, Relevance, imputed_items
from replayers.counterfactual.results import Assignment
from replayers.counterfactual.run_nodes import (
    Choose,
    Leaf,
    Node,
    PricedMove,
    Segment,
    SegmentEnd,
    UnfinishedWalk,
    UnobservedLook,
)
from replayers.counterfactual.tree.options import MAX_STEPS, TreeOptions, zero_clock
from replayers.counterfactual.tree.put_downs import destinations, is_put_down
from replayers.counterfactual.tree.quick_segment import QuickRun, QuickSegment
from workbench.beliefs.belief import Estimator
from workbench.execution.events import ActionEnded, Event, PlanMade, RunEnded, RunStatus
from workbench.execution.loop import LoopOptions, run_task
from workbench.execution.run_end import GOAL_MET
from workbench.planning.strategy import Decision, Strategy
from workbench.worlds.house import ContainerId, Item, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start
from workbench.worlds.world import ActionDone, NotInLog


@final
class RunTree:
    """A strategy's runs over one log, remembered as far as they have been followed.

    Attributes:
        root: the start.
        segments: how many segments were run.
        max_picks: the most picks of any path followed; MAX_STEPS where one puts something down on the way.
        ambiguous: at some node, histories that share it may go on differently (Node.ambiguous).
        asked: open containers that the strategy was seen to look into, in some world.
        planner: the strategy, asked once for each state that it can distinguish if it is known to decide by that.
    """

    def __init__(
        self,
        evidence: Evidence,
        strategy: Strategy,
        estimator: Estimator,
        relevance: Relevance,
        options: TreeOptions = TreeOptions(),
    ) -> None:
        self.evidence = evidence
        self.relevance = relevance
        self.strategy = strategy
        self.segments = 0
        self.max_picks = 0
        self.ambiguous = False
        self.asked: dict[ContainerId, None] = {}
        self.max_steps = options.max_steps
        self.traits = options.traits
        unmoved = options.static_beliefs or not options.reads_beliefs
        needed = needed_items(evidence, options.looks_by) if options.traits.fetches_nearest and unmoved else None
        self._key = StateKey(relevance, unmoved, evidence.misses_left if evidence.misses else None, needed)
        self._reads_beliefs = options.reads_beliefs and not (options.static_beliefs and options.exact_beliefs)
        self._memoized = MemoizedStrategy(strategy, self._key, watch=self._reads_beliefs) if options.merge else None
        self.planner = self._memoized or strategy
        self._estimator = estimator
        self._options = options
        self._wanted = destinations(evidence.task.goal) if options.merge else {}
        self._with_all_items: RunTree | None = None
        plain = not evidence.misses and evidence.passing is None and evidence.tags is None
        self._quick = self._same = None
        if options.merge and is_plain(evidence):
            made_of = None if self._reads_beliefs else options.made_of
            self._quick = QuickRun(evidence, self.planner, estimator, made_of, needed, seed=options.seed)
        if options.merge and options.exact_beliefs and plain:
            self._same = SameDecision(
                strategy,
                estimator,
                evidence.open,
                relevance.live_and_shown,
                policy=options.looks_by,
                parts=options.parts,
                at_most=options.asked_again,
            )
        self._nodes: dict[Hashable, Node] = {}
        self._seen, self._open = evidence.seen_types(), frozenset(evidence.open)
        unseen = (*evidence.open, *(evidence.doubtful if evidence.misses else ()))
        self._another = AnotherInstance(strategy, unseen, relevance, self._stands if self._reads_beliefs else None)
        self.root = Node(knowledge=knowledge_at_start(evidence.place.plan, evidence.travel, evidence.known))

    @property
    def guesses(self) -> bool:
        """Whether decisions go by beliefs that are not quite the robot's: a log rounded them."""
        return self._reads_beliefs and not self._options.exact_beliefs

    def with_all_items(self) -> RunTree:
        """The tree in which all items that still matter distinguish histories; cached."""
        if self._with_all_items is None:
            options = replace(self._options, traits=replace(self.traits, fetches_nearest=False))
            self._with_all_items = RunTree(self.evidence, self.strategy, self._estimator, self.relevance, options)
        return self._with_all_items

    def advance(self, node: Node) -> Segment:
        """Runs on from a node to its next unobserved look or its end; cached."""
        if node.segment is None:
            if self._memoized is not None:
                self._memoized.ambiguous = False
            node.segment = self._run(node)
            node.ambiguous = self._memoized is not None and self._memoized.ambiguous
            self.ambiguous |= node.ambiguous
        return node.segment

    def child(self, node: Node, answer: Answer) -> Node:
        """The node after an answer at a node."""
        found = node.children.get(answer)
        if found is None:
            found = node.children[answer] = self._after(node, answer)
        return found

    def seen_in_passing(self, node: Node) -> tuple[tuple[float, Node], ...]:
        """The nodes after a tag was seen in passing in a node's segment, each with the cost from the node to it.

        Whether the robot sees a tag that is in view, the log does not say: all of them are consistent with it.
        """
        if node.sighted is None:
            node.sighted = tuple(self._after_sightings(node))
        return node.sighted

    def follow(self, choose: Choose) -> Leaf:
        """Runs to an end, choosing an answer at every unobserved look."""
        node, cost, filled = self.root, 0.0, list[Assignment]()
        while True:
            segment = self.advance(node)
            if node.ambiguous:
                return self._follow_apart(filled, choose)
            cost += segment.cost
            unobserved = segment.unobserved
            if unobserved is None:
                return self._leaf(segment, cost, tuple(filled))
            answer = choose(unobserved)
            filled.append(Assignment(container=unobserved.container, live=unobserved.live, answer=answer))
            node = self.child(node, answer)

    def _follow_apart(self, filled: list[Assignment], choose: Choose) -> Leaf:
        """The same from the start, in the tree with all items."""
        answers, apart = {f.container: f.answer for f in filled}, self.with_all_items()
        before = apart.segments
        leaf = apart.follow(lambda look: answers[look.container] if look.container in answers else choose(look))
        self.segments += apart.segments - before
        self.asked |= apart.asked
        return leaf

    def certain(self, node: Node) -> bool:
        """Whether the run from a node on is the same whatever else the open containers on the way held, and whatever
        rounding took from beliefs."""
        if node.certain is None:
            node.certain = self._is_certain(node)
        return node.certain

    def _is_certain(self, node: Node) -> bool:
        decided = self.advance(node).decided
        if node.imputed and not self._another.changes_nothing(decided):
            return False
        if self._options.exact_beliefs and not node.imputed:
            return True
        return all(self._stands(one.basis, one.made) for one in decided if self._by_beliefs(one))

    def _stands(self, basis: DecisionBasis | None, made: Decision) -> bool:
        """Whether a decision by beliefs is the same whatever else the open containers on the way held."""
        return basis is not None and self._same is not None and self._same.holds(basis, made)

    def events(self, leaf: Leaf, *, explained_by: Strategy | None = None) -> tuple[Event, ...]:
        """The events of the run that ends in a leaf, from the start and with the paths walked.

        Args:
            explained_by: the same strategy with its explanations, which the tree's own strategy leaves out.
        """
        answers = {f.container: f.answer for f in leaf.filled}
        world = LoggedWorld(
            self.evidence,
            filling=lambda c, _: self._imputed(answers.get(c, ()), c),
            durations=self._options.durations,
            as_recorded=self._options.as_driven,
        )
        return tuple(self._events(world, planner=explained_by))

    def segment_events(self, node: Node) -> tuple[Event, ...]:
        """The events of a node's segment: what its run does up to the next unobserved look or to its end."""
        world = self._world_at(node)
        return tuple(self._events(world, begin_with=node.knowledge, steps_left=self.max_steps - node.steps))

    def _imputed(self, answer: Answer, container: ContainerId) -> tuple[Item, ...]:
        return imputed_items(answer, container, self.evidence.contents.get(container))

    def _after(self, node: Node, answer: Answer) -> Node:
        segment = self.advance(node)
        assert segment.unobserved is not None, "an end has no answers"
        container = segment.unobserved.container
        before = segment.unobserved.knowledge
        put = before.items_at.get(LocationId(container), ())
        inside = (*self.evidence.shown_in(container), *self._imputed(answer, container))
        inside = inside if self.evidence.tags is None else before.left_in(container, inside)
        knowledge = before.seen(container, (*inside, *(item for item in put if item not in inside)))
        steps, picks = node.steps + segment.steps, node.picks + segment.picks
        self.max_picks = max(self.max_picks, picks)
        cost = node.cost + segment.cost
        walk = segment.unobserved.walk
        if walk is not None:
            walk = replace(
                walk,
                contents_in_view=MappingProxyType(
                    {**walk.contents_in_view, container: self._imputed(answer, container)}
                ),
            )
        made = Node(knowledge=knowledge, walk=walk, imputed=True, steps=steps, picks=picks, cost=cost)
        key = (self._key(knowledge), None if walk is None else walk.key)
        return self._nodes.setdefault(key, made) if self._options.merge else made

    def _after_sightings(self, node: Node) -> Iterator[tuple[float, Node]]:
        tags = self.evidence.tags
        if tags is None or self._options.as_driven:
            return
        for move in self.advance(node).moves_to_look:
            before, target = move.made.before, move.made.move.target
            for view in tags.in_view(before.robot_at, target):
                container = view.container
                if container in before.first_seen:
                    continue
                points = tags.turning_points(before.robot_at, target, container)
                seeking = move.made.move.seeking or ()
                for item in may_be_sighted(self.evidence, self.relevance, container, seeking, before):
                    known = before.sighted(container, item)
                    for turn in points:
                        there = replace(known, travel=tags.travel_from(turn.location)).moved(turn.location)
                        cost, steps, picks = move.cost + turn.walked_m, move.steps + 1, move.picks
                        made = Node(
                            knowledge=there,
                            imputed=node.imputed,
                            steps=node.steps + steps,
                            picks=node.picks + picks,
                            cost=node.cost + cost,
                        )
                        key = (self._key(there), None)
                        yield cost, self._nodes.setdefault(key, made) if self._options.merge else made

    def _run(self, node: Node) -> Segment:
        self.segments += 1
        if self._quick is not None:
            made = self._quick.segment(node.knowledge, steps_left=self.max_steps - node.steps)
            if made is not None:
                return self._as_segment(made, node)
        world = self._world_at(node)
        steps, picks, walked, spent, decided = 0, 0, 0.0, 0.0, list[Decided]()
        puts_down, moves = False, list[PricedMove]()
        if node.walk is not None:
            world, unknown, walked = self._walked(node, node.walk)
            if unknown is not None:
                return Segment(cost=0.0, steps=0, picks=0, unobserved=unknown, ended=None)
            steps = 1
        ended: RunEnded | None = None
        for event in self._events(world, begin_with=world.knowledge, steps_left=self.max_steps - node.steps - steps):
            if isinstance(event, ActionEnded):
                for made in world.moves_to_look[len(moves) :]:
                    moves.append(PricedMove(made=made, cost=spent, steps=steps, picks=picks))
                steps += 1
                picks += event.success and event.step.action == "pick"
                puts_down |= event.success and is_put_down(event.step, self._wanted)
                spent += event.cost
            elif isinstance(event, PlanMade):
                decided.append(Asked(self._memoized.basis if self._memoized else None, event.made))
            elif isinstance(event, RunEnded):
                ended = event
        assert ended is not None, "the loop always ends with Ended"
        self.max_picks = MAX_STEPS if puts_down else max(self.max_picks, node.picks + picks)
        cost, unobserved = walked + ended.own_cost, None
        if ended.status is RunStatus.UNDETERMINED and ended.unseen is not None:
            move = world.unfinished
            walk = None if move is None else UnfinishedWalk(before=world.knowledge, move=move)
            unobserved = self._unobserved_look(ended.unseen, world.knowledge, walk)
            cost += self.evidence.costs.search if walk is None else 0.0
            steps += walk is None
        return Segment(
            cost=cost,
            steps=steps,
            picks=picks,
            unobserved=unobserved,
            ended=SegmentEnd(ended.status, ended.reason) if unobserved is None else None,
            decided=tuple(decided),
            moves_to_look=tuple(moves),
        )

    def _as_segment(self, made: QuickSegment, node: Node) -> Segment:
        puts_down = any(is_put_down(step, self._wanted) for step in made.placed)
        self.max_picks = MAX_STEPS if puts_down else max(self.max_picks, node.picks + made.picks)
        cost, steps, unobserved = made.cost, made.steps, None
        if made.unobserved is not None:
            unobserved = self._unobserved_look(made.unobserved, made.knowledge, None)
            cost, steps = cost + self.evidence.costs.search, steps + 1
        return Segment(
            cost=cost,
            steps=steps,
            picks=made.picks,
            unobserved=unobserved,
            ended=SegmentEnd(RunStatus.DONE, GOAL_MET) if unobserved is None else None,
            decided=tuple(made.decided),
            without_events=True,
        )

    def _by_beliefs(self, decided: Decided) -> bool:
        return self._reads_beliefs and (decided.basis is None or bool(decided.basis.read))

    def _world_at(self, node: Node) -> LoggedWorld:
        return LoggedWorld(
            self.evidence, with_paths=False, knowledge=node.knowledge, as_recorded=self._options.as_driven
        )

    def _walked(self, node: Node, walk: UnfinishedWalk) -> tuple[LoggedWorld, UnobservedLook | None, float]:
        """The world after the move that a node is on, what else comes into view on it, and its metres."""
        world = LoggedWorld(
            self.evidence,
            with_paths=False,
            knowledge=walk.before,
            filling=lambda container, _: walk.contents_in_view.get(container),
        )
        answer = world.go_to(walk.move.target, seeking=walk.move.seeking)
        if isinstance(answer, NotInLog):
            return world, self._unobserved_look(answer.container, node.knowledge, walk), 0.0
        assert isinstance(answer, ActionDone), "the move was begun before"
        return world, None, answer.travel_m

    def _events(
        self,
        world: LoggedWorld,
        *,
        begin_with: Knowledge | None = None,
        steps_left: int = MAX_STEPS,
        planner: Strategy | None = None,
    ) -> Iterator[Event]:
        events = run_task(
            world,
            planner or self.planner,
            self._estimator,
            self.evidence.task,
            costs=self.evidence.costs,
            seed=self._options.seed,
            options=LoopOptions(max_steps=max(1, steps_left), stopwatch=zero_clock, begin_with=begin_with),
        )
        return with_beliefs(events)

    def _unobserved_look(
        self, container: ContainerId, knowledge: Knowledge, walk: UnfinishedWalk | None
    ) -> UnobservedLook:
        self.asked[container] = None
        live = self.relevance.live(knowledge)
        if self.evidence.misses:
            possible = possible_contents(self.evidence, self.relevance, container, knowledge)
            options, others = possible.options()
            return UnobservedLook(
                container=container,
                live=live,
                options=options,
                others=others,
                knowledge=knowledge,
                possible=possible,
                walk=walk,
            )
        settled = [c for c in knowledge.first_seen if c in self._open]
        found = frozenset(item.type for c in settled for item in knowledge.first_seen[c])
        if self.evidence.tags is not None:  # what was seen in passing is somewhere too
            found |= {t for t in live if knowledge.has_known_instance(t)}
        left = len(self._open) - len(settled) - 1
        options, others = self.relevance.options(live, found_before=found, open_left=left, seen=self._seen)
        return UnobservedLook(
            container=container, live=live, options=options, others=others, knowledge=knowledge, walk=walk
        )

    def _leaf(self, segment: Segment, own_cost: float, filled: tuple[Assignment, ...]) -> Leaf:
        assert segment.ended is not None, "a leaf is an end"
        charged = own_cost if segment.done else self.evidence.task.failure_cost
        return Leaf(filled=filled, cost=charged, own_cost=own_cost, status=segment.ended.status)
