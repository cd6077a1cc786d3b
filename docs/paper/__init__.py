"""Seminara 2018 recomputed: `make paper` writes docs/paper.md and docs/figures/paper-fig*.svg."""
