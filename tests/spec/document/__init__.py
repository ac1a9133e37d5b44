"""A second, independent reading of the vendor's document, and its comparison with ours."""
