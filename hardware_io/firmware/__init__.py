"""The program of the robots, in C for the ATmega2560; the Makefile builds it with avr-gcc."""
