"""Episodes as arrays: what environments for learners have in common.

`beacon_mj.gym` and `beacon_mj.dm_suite` put it behind the interfaces of others.
"""
