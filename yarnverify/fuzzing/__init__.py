"""Random search for elements at which a kernel breaks what it promises.

    judge.py     one element: computed against true results, and what is wrong with them
    search.py    Hypothesis draws elements, steers towards large errors and shrinks what it finds, within a time budget

The command is ``yarnverify fuzz``; what it prints can be pasted into a test.
"""
