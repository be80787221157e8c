"""The minimum-time programme: direct transcription with CasADi, solved by IPOPT.

Source: multiple shooting, Bock and Plitt, "A multiple shooting algorithm for direct solution of
optimal control problems" (1984); IPOPT, Waechter and Biegler (2006).
"""
