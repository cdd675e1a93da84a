"""Reference decoder of the Tandem protocol, written from idl/PROTOCOL.md alone."""
