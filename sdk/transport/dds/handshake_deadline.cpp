#include "sdk/transport/dds/handshake_deadline.hpp"

#include <dds/dds.h>
#include <dds/version.h>

// Cyclone DDS gives a handshake 100 s. Up to 0.10.5, the timer of one that ran out of time is taken out of
// the heap of timers twice. Then other timers are lost, or the thread of the handshakes spins for ever, and
// the process hears nothing any more (Cyclone's issue 1548, mended in 11.0). Anybody could cause that who
// announces himself and stays, such as a program with the identity of another authority. So no handshake has
// a deadline: it goes on, with a packet a second, until the other participant has left. Cyclone calls the
// function through its table of symbols, in which the definition of the program, or of the library that
// loaded Cyclone, stands before its own.
#if DDS_VERSION_MAJOR == 0
extern "C" {
// As dds/security/core/dds_security_fsm.h has it, which no C++ compiler reads.
struct dds_security_fsm;
using dds_security_fsm_action = void (*)(dds_security_fsm* fsm, void* arg);

__attribute__((visibility("default"))) void dds_security_fsm_set_timeout(dds_security_fsm* /*fsm*/,
                                                                         dds_security_fsm_action /*action*/,
                                                                         dds_duration_t /*timeout*/) {}
}
#endif

namespace tandem::transport::dds {

void without_handshake_deadline() {}

}  // namespace tandem::transport::dds
