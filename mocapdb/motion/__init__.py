"""The nouns: skeletons, clips, how joints move, representations, and the skin that measures loss.

==================  ======================================================================="""
