"""What every stage stands on: rotations, skeletons, clips, inverse kinematics, safe files, errors."""
