"""What a residual says of a model: noise, repeats, folds that no fit saw."""
