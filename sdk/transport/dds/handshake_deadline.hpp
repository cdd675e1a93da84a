#pragma once
// Keeps Cyclone DDS 0.10 from spinning for ever in its handshakes.

namespace tandem::transport::dds {

/// The call itself does nothing: it makes the linker replace a function of Cyclone DDS in the program that
/// contains it, for all threads and from the start. A shared library that is to do so needs
/// handshake_deadline.cpp among its own sources, and exports that function.
void without_handshake_deadline();

}  // namespace tandem::transport::dds
