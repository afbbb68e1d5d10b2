"""How is the paper's network trained? Cross entropy over distinct weighted triples, stopped on held-out houses."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from torch import nn

from workbench.beliefs.encoder import TextEncoder, vectors_of
from workbench.beliefs.examples import Examples
from workbench.beliefs.fcnn import ROLES
from workbench.beliefs.weights import Tensor

HIDDEN = (256, 128, 64)
EPOCHS = 60
PATIENCE = 12
"""Epochs without a better held-out loss before training stops."""
BATCH = 256
RATE = 2e-3
DECAY = 1e-4
DROPOUT = 0.3

Watch = Callable[[int, float], None]
"""Called after each epoch with its number and the held-out loss."""


def network(width: int, hidden: tuple[int, ...] = HIDDEN, *, dropout: float = DROPOUT) -> nn.Sequential:
    """The paper's fully connected network: rectified layers with dropout, one logit."""
    layers: list[nn.Module] = []
    for size in hidden:
        layers += [nn.Linear(width, size), nn.ReLU(), nn.Dropout(dropout)]
        width = size
    return nn.Sequential(*layers, nn.Linear(width, 1))


def train_fcnn(
    examples: Examples,
    held_out: Examples,
    encoder: TextEncoder,
    *,
    seed: int,
    epochs: int = EPOCHS,
    watch: Watch | None = None,
) -> dict[str, Tensor]:
    """Train and return the tensors of the epoch with the least held-out loss, as float16.

    Args:
        examples, held_out: of different houses.
        watch: told of every epoch.
    """
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    device = "cuda" if torch.cuda.is_available() else "cpu"
    inputs, share, weight = (t.to(device) for t in _rows(examples, encoder))
    tested = tuple(t.to(device) for t in _rows(held_out, encoder))
    net = network(inputs.shape[1]).to(device)
    steps = epochs * -(-len(inputs) // BATCH)
    optimizer = torch.optim.AdamW(net.parameters(), lr=RATE, weight_decay=DECAY)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, RATE, total_steps=steps, pct_start=0.1)
    best, best_loss, since = _tensors(net), float("inf"), 0
    for epoch in range(epochs):
        net.train()
        order = torch.from_numpy(rng.permutation(len(inputs))).to(device)
        for rows in order.split(BATCH):
            loss = _loss(net, inputs[rows], share[rows], weight[rows])
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
        net.eval()
        with torch.no_grad():
            held = float(_loss(net, *tested))
        if watch:
            watch(epoch, held)
        since += 1
        if held < best_loss:
            best, best_loss, since = _tensors(net), held, 0
        if since >= PATIENCE:
            break
    return best


def _rows(examples: Examples, encoder: TextEncoder) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Inputs, shape (triples, 3 * (dimensions + 3)); the share that held; the weight, 1 on average."""
    columns: list[Tensor] = []
    for k, names in enumerate((examples.rooms, examples.containers, examples.items)):
        vectors = vectors_of(encoder, names)
        one_hot = np.tile(np.eye(len(ROLES), dtype=np.float32)[k], (len(names), 1))
        columns.append(np.concatenate([vectors, one_hot], axis=1)[examples.triples[:, k]])
    share, weight = examples.held / examples.seen, examples.seen / examples.seen.mean()
    return (
        torch.from_numpy(np.concatenate(columns, axis=1)),
        torch.from_numpy(share.astype(np.float32)),
        torch.from_numpy(weight.astype(np.float32)),
    )


def _loss(net: nn.Module, inputs: torch.Tensor, share: torch.Tensor, weight: torch.Tensor) -> torch.Tensor:
    """Weighted cross entropy, per unit of weight."""
    logits = net(inputs)[:, 0]
    loss = nn.functional.binary_cross_entropy_with_logits(logits, share, weight=weight, reduction="sum")
    return loss / weight.sum()


def _tensors(net: nn.Sequential) -> dict[str, Tensor]:
    linear = [layer for layer in net if isinstance(layer, nn.Linear)]
    parts = {f"{k}.{name}": value for k, layer in enumerate(linear) for name, value in layer.named_parameters()}
    return {name: value.detach().cpu().numpy().astype(np.float16) for name, value in parts.items()}
