"""The pages' cameras: where they stand, what lies under a pointer, which labels are seen."""
