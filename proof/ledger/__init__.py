"""The ledger: campaigns with their truth and the stored answers, which show in minutes what a change of the code
affects.

`make ledger` diagnoses all of them and compares; CONTRIBUTING.md explains how to read it.
"""
