"""The program of the robots, in C for the ATmega2560; the Makefile builds it with avr-gcc.

`board/` is what reads and writes the processor's registers; `portable/` needs no AVR, so the tests
compile it for their own machine, with sanitizers.
"""
