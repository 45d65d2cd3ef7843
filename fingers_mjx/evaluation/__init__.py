"""Many randomized episodes of a policy, and the paper's measures of them."""
