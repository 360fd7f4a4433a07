"""What everything stands on: arrays, kernels, files, threads, names that load on first use.

==============  =============================================================
`arrays`        names for the array types that the signatures use
`files`         files that are there whole or not at all
`machine`       what a figure was measured on
`kernels`       one spelling of numba's decorator for every kernel in mocapdb
`_compilers`    how numba compiles kernels
`selection`     kernels that order numbers
`lazy`          names of a package that load on first use
`kept_answers`  answers kept for as long as what was asked about lives
`spelling`      what was probably meant by a name that there is not
`interrupts`    Ctrl-C where Python would lose it
`progress`      how work that takes long reports its progress
`thread_pool`   threads that share work with the one that asks for it
`workers`       processes, of this machine or a cluster, that share work
==============  =============================================================
"""
