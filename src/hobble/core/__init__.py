"""Code that every stage uses: rotations, skeletons, clips, inverse kinematics, safe files, errors."""
