// A target needs a source; the precompiled header is in CMakeLists.txt.
