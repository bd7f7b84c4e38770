"""The Whitted-style scene form of Tachyon and NFF: builder, tessellation, frame, conversion to PBR."""
