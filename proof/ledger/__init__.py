"""The ledger: campaigns, their truth and the answers kept for each, to see in minutes what a change moved.

`make ledger` diagnoses all of them and compares; CONTRIBUTING.md says how it is read.
"""
