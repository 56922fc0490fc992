"""The runtime around the graphs of the transformer in numpy: the reference for the C++. It does look-ups, neighbours,
the relative bias, and the cache of keys and values; for a frame at once, or cell after cell with codes that a caller
chooses."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from export.densepose.graphs import session
from export.prediction.attention import PLACES
from export.prediction.config import CODE_SIDE
from export.prediction.graphs.transformer_file import TransformerTables
from export.prediction.graphs.transformer_graphs import CONTEXT, NEIGHBOURS, SLICES, head_name, slice_names
from export.prediction.transformer import UNSEEN

# Logits [K] of slice k at a cell -> the code.
Choice = Callable[[int, int, np.ndarray], int]


class GraphRuntime:
    """One frame at a time: `begin`, then `logits` of given codes, or `chosen` codes. prior float32 [slices, K + 1, K]:
    log-probabilities by the code before (K: none), added to the logits."""

    def __init__(self, folder: Path, tables: TransformerTables, prior: np.ndarray) -> None:
        self.tables, self.priors = tables, prior
        self.slice_count, self.entries = len(tables.earlier), len(tables.slice_rows) // len(tables.earlier)
        self.layers, self.heads = tables.row_bias.shape[:2]
        self.context_graph, self.slice_graph = (session(folder / f"{name}.onnx") for name in (CONTEXT, SLICES))
        self.head_graphs = [session(folder / f"{head_name(k)}.onnx") for k in range(self.slice_count)]
        self.head_width = self.slice_graph.get_inputs()[2].shape[-1]
        row, column = np.divmod(np.arange(PLACES), CODE_SIDE)
        steps = [axis[:, None] - axis[None] + CODE_SIDE - 1 for axis in (row, column)]
        self.bias = tables.row_bias[:, :, steps[0]] + tables.column_bias[:, :, steps[1]]  # [layers, heads, 256, 256]
        self.bias[:, :, np.triu(np.ones((PLACES, PLACES), bool), 1)] = -np.inf

    def begin(self, before: np.ndarray, fps: float) -> None:
        """before int64 [seen, slices, 16, 16], oldest first, the one by motion last, UNSEEN where there was none."""
        entries = self.entries
        codes = before.reshape(-1, PLACES)  # [seen * slices, 256]
        first = np.arange(len(codes))[:, None] * entries
        rows = self.tables.context_rows[np.where(codes == UNSEEN, 0, codes + first)]
        summed = np.where((codes == UNSEEN)[..., None], 0, rows).sum(0, dtype=np.float32)
        step = np.array([[np.log2(10 / fps)]], np.float32)
        (self.context,) = self.context_graph.run(None, {"summed": summed[None], "time_step": step})
        newest = before[self.tables.before - 1]
        last = np.where(newest == UNSEEN, entries, newest).reshape(-1, PLACES)
        self.prior = np.stack([self.priors[k][own] for k, own in enumerate(last)])  # [slices, 256, K]

    def embedded(self, codes: np.ndarray) -> np.ndarray:
        """Codes [slices, 16, 16] -> [16, 16, embedding]."""
        first = np.arange(len(codes))[:, None, None] * self.entries
        return self.tables.slice_rows[codes + first].sum(0)

    def logits(self, codes: np.ndarray) -> np.ndarray:
        """Logits of each code of a frame given the codes before it: codes int64 [slices, 16, 16] -> [slices, 256,
        K]."""
        padded = np.pad(self.embedded(codes), ((2, 0), (1, 1), (0, 0)))
        near = np.concatenate(
            [padded[2 + y :, 1 + x :][:CODE_SIDE, :CODE_SIDE] for y, x in NEIGHBOURS], -1
        ).reshape(1, PLACES, -1)  # fmt: skip
        nothing = np.zeros((1, self.heads, 0, self.head_width), np.float32)
        caches = [array for own in self.bias for array in (nothing, nothing, own)]
        features = self._slices(self.context, near, caches)[0]
        known, found = codes.reshape(len(codes), PLACES), []
        for k in range(len(codes)):
            found.append(self._head(k, features, known[:k]) + self.prior[k])
        return np.stack(found)

    def chosen(self, choose: Choice) -> np.ndarray:
        """Codes int64 [slices, 16, 16], cell after cell; `choose` is given slice, cell and logits."""
        codes = np.zeros((self.slice_count, PLACES), np.int64)
        embedded = np.zeros(
            (CODE_SIDE + 2, CODE_SIDE + 2, self.tables.slice_rows.shape[1]), np.float32
        )  # two above, one beside
        sizes = (self.layers, self.heads, PLACES, self.head_width)
        keys, values = np.zeros(sizes, np.float32), np.zeros(sizes, np.float32)
        first = np.arange(self.slice_count) * self.entries
        for place in range(PLACES):
            row, column = divmod(place, CODE_SIDE)
            near = np.concatenate([embedded[2 + row + y, 1 + column + x] for y, x in NEIGHBOURS])
            caches = []
            for layer, bias in enumerate(self.bias):
                # A cell sees the cached cells before it, and itself.
                own = np.full((self.heads, 1, PLACES + 1), -np.inf, np.float32)
                own[:, 0, :place], own[:, 0, PLACES] = bias[:, place, :place], bias[:, place, place]
                caches += [keys[layer][None], values[layer][None], own]
            features, *new = self._slices(self.context[:, place : place + 1], near[None, None], caches)
            for layer in range(self.layers):
                keys[layer, :, place], values[layer, :, place] = new[2 * layer][0, :, 0], new[2 * layer + 1][0, :, 0]
            for k in range(self.slice_count):
                logits = self._head(k, features, codes[:k, place : place + 1])[0] + self.prior[k, place]
                codes[k, place] = choose(k, place, logits)
            embedded[2 + row, 1 + column] = self.tables.slice_rows[codes[:, place] + first].sum(0)
        return codes.reshape(-1, CODE_SIDE, CODE_SIDE)

    def _slices(self, context: np.ndarray, near: np.ndarray, caches: list[np.ndarray]) -> list[np.ndarray]:
        names = slice_names(self.layers)[0]
        given = dict(zip(names, (context, near, *caches), strict=True))
        return self.slice_graph.run(None, {name: np.ascontiguousarray(array) for name, array in given.items()})

    def _head(self, k: int, features: np.ndarray, known: np.ndarray) -> np.ndarray:
        """known: codes [k, cells] of the slices before -> logits [cells, K]."""
        earlier = np.zeros_like(features[0])
        for table, codes in zip(self.tables.earlier[k], known, strict=True):
            earlier = earlier + table[codes]
        return self.head_graphs[k].run(None, {"features": features, "earlier": earlier[None]})[0][0]
