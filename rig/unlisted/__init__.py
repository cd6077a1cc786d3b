"""Virtual measurement campaigns of an electronic skin, each with one concealed law that no catalogue lists."""
