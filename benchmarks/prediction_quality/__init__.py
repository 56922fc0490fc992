"""How alike predicted pictures are to the true ones, and how exact the motion behind them is."""
