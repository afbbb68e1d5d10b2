"""Training of the paper's network: cross entropy over weighted triples, with early stopping on held-out houses.

The result may be a running mean of the weights over the last steps (Polyak and Juditsky 1992), which is less noisy
than the weights themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import torch
from torch import nn

from workbench.arrays import AnyArray
from workbench.beliefs.encoder import TextEncoder, vectors_of
from workbench.beliefs.examples import Examples
from workbench.beliefs.fcnn import ROLES


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingSettings:
    """Hyperparameters of training; the defaults were chosen by the loss on held-out houses.

    Attributes:
        hidden: widths of the hidden layers.
        epochs: maximum number; the learning rate decays to zero over them.
        patience: epochs without a better held-out loss before training stops.
        batch: triples per step.
        rate, decay: AdamW's learning rate at its peak, and its weight decay.
        dropout: share of hidden units left out while training.
        memory: decay per step of the running mean of the weights; 0 keeps the weights themselves.
    """

    hidden: tuple[int, ...] = (256, 128, 64)
    epochs: int = 120
    patience: int = 15
    batch: int = 256
    rate: float = 1e-3
    decay: float = 1e-4
    dropout: float = 0.3
    memory: float = 0.0


PAPER = TrainingSettings(memory=0.995)

TrainingListener = Callable[[int, float], None]
"""Called after each epoch with its number and the held-out loss."""


class Fcnn(nn.Module):
    """The paper's fully connected network: rectified layers with dropout, one logit.

    The input consists of three blocks of names, and the first layer is linear in each: every name passes its block
    once per step, and each row adds the results of its three names. This is the same network at a third of the
    cost.
    """

    def __init__(self, blocks: Sequence[torch.Tensor], recipe: TrainingSettings) -> None:
        """blocks: inputs of rooms, containers, items, shape (names, dimensions + 3) each."""
        super().__init__()
        widths = (sum(block.shape[1] for block in blocks), *recipe.hidden, 1)
        self.blocks = list(blocks)
        self.linear = nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(widths))
        self.dropout = nn.Dropout(recipe.dropout)

    def forward(self, triples: torch.Tensor) -> torch.Tensor:
        """Log-odds of triples of name indices, shape (rows, 3) -> (rows,)."""
        first, *others = self.linear
        assert isinstance(first, nn.Linear)
        shares = first.weight.split([block.shape[1] for block in self.blocks], dim=1)
        hidden = first.bias
        for k, (block, share) in enumerate(zip(self.blocks, shares, strict=True)):
            used, at = torch.unique(triples[:, k], return_inverse=True)
            hidden = hidden + nn.functional.embedding(at, block[used] @ share.T)
        for layer in others:
            hidden = layer(self.dropout(torch.relu(hidden)))
        return hidden[:, 0]


def train_fcnn(
    examples: Examples,
    held_out: Examples,
    encoder: TextEncoder,
    *,
    seed: int,
    recipe: TrainingSettings = PAPER,
    watch: TrainingListener | None = None,
) -> dict[str, AnyArray]:
    """Train and return the tensors of the epoch with the least held-out loss, as float16.

    Args:
        examples, held_out: of different houses.
        watch: called after every epoch.
    """
    torch.set_num_threads(1)  # more threads gain nothing here and change the order of sums
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    device = chosen_device()
    known = _known(examples, held_out)
    blocks = [block.to(device) for block in _blocks(known, encoder)]
    triples, share, weight = (t.to(device) for t in _rows(examples, known))
    tested = tuple(t.to(device) for t in _rows(held_out, known))
    net = Fcnn(blocks, recipe).to(device)
    mean = deepcopy(net).eval()
    steps = recipe.epochs * -(-len(triples) // recipe.batch)
    optimizer = torch.optim.AdamW(net.parameters(), lr=recipe.rate, weight_decay=recipe.decay)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, recipe.rate, total_steps=steps, pct_start=0.1)
    best, best_loss, since = _tensors(mean), float("inf"), 0
    for epoch in range(recipe.epochs):
        net.train()
        order = torch.from_numpy(rng.permutation(len(triples))).to(device)
        for rows in order.split(recipe.batch):
            loss = _loss(net, triples[rows], share[rows], weight[rows])
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
            _update_running_mean(mean, net, recipe.memory)
        with torch.no_grad():
            held = float(_loss(mean, *tested))
        if watch:
            watch(epoch, held)
        since += 1
        if held < best_loss:
            best, best_loss, since = _tensors(mean), held, 0
        if since >= recipe.patience:
            break
    return best


def chosen_device() -> str:
    """The GPU if there is one, else the CPU."""
    return "cuda" if torch.cuda.is_available() else "cpu"


def _update_running_mean(mean: Fcnn, net: Fcnn, memory: float) -> None:
    """One step of the running mean towards the weights."""
    with torch.no_grad():
        for old, new in zip(mean.parameters(), net.parameters(), strict=True):
            old.lerp_(new, 1.0 - memory)


Known = tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]
"""Names of rooms, containers and items."""


def _known(*parts: Examples) -> Known:
    axes = [(e.rooms, e.containers, e.items) for e in parts]
    rooms, containers, items = (tuple(sorted({n for axis in axes for n in axis[k]})) for k in range(3))
    return rooms, containers, items


def _blocks(known: Known, encoder: TextEncoder) -> list[torch.Tensor]:
    """Each name's vector followed by its one-hot kind, shape (names, dimensions + 3)."""
    blocks: list[torch.Tensor] = []
    for k, names in enumerate(known):
        one_hot = np.tile(np.eye(len(ROLES), dtype=np.float32)[k], (len(names), 1))
        blocks.append(torch.from_numpy(np.concatenate([vectors_of(encoder, names), one_hot], axis=1)))
    return blocks


def _rows(examples: Examples, known: Known) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Triples of name indices, the share that held, and the weight (1 on average)."""
    columns: list[AnyArray] = []
    for k, names in enumerate((examples.rooms, examples.containers, examples.items)):
        at = {name: i for i, name in enumerate(known[k])}
        columns.append(np.array([at[name] for name in names], dtype=np.int64)[examples.triples[:, k]])
    share, weight = examples.held / examples.seen, examples.seen / examples.seen.mean()
    return (
        torch.from_numpy(np.stack(columns, axis=1)),
        torch.from_numpy(share.astype(np.float32)),
        torch.from_numpy(weight.astype(np.float32)),
    )


def _loss(net: Fcnn, triples: torch.Tensor, share: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
    """Weighted cross entropy, per unit of weight."""
    loss = nn.functional.binary_cross_entropy_with_logits(net(triples), share, weight=weight, reduction="sum")
    return loss / weight.sum()


def _tensors(net: Fcnn) -> dict[str, AnyArray]:
    parts = {f"{k}.{name}": value for k, layer in enumerate(net.linear) for name, value in layer.named_parameters()}
    return {name: value.detach().cpu().numpy().astype(np.float16) for name, value in parts.items()}
