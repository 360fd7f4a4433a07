"""The body and the rate that every clip is compared on.

==================  ===========================================================================
`canonical_body`    The canonical body: 18 joints of one size that every skeleton is brought to
`canonical_motion`  A clip on the canonical body, at one frame rate
==================  ===========================================================================
"""
