"""What single trees, lying logs, barriers and stands hold back, and where barriers would."""
