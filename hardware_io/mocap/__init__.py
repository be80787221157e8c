"""Where robots are: motion capture, LCM, recordings and the emulation behind one interface."""
