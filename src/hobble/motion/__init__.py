"""Converts BVH files of any rig and frame rate to checked clips on the target skeleton."""
