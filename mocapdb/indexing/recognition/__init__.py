"""Classes of motion: densities of poses, and what a clip is by them.

==============  ====================================================================================
`class_models`  Classes of motion: what a clip is, whether it is any of them, and where each goes
`examples`      The clips that classes were learned from, and how far a clip is from each of them
`ppca`          Probabilistic principal components: the density of a class of poses
==============  ====================================================================================
"""
