"""The station's nodes and the pure code behind them."""

__version__ = "0.1.0"
