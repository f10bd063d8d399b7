#pragma once

// X.509 certificates as PEM texts: an authority of the gateway's own, and a server certificate that
// it vouches for. Both have P-256 keys.
//
// A phone that trusts the authority trusts whoever has its key. So it can vouch only for addresses
// of private networks, for names that no public authority gives out (.local, .lan, .internal,
// .home.arpa), and for the names and addresses it was made with (RFC 5280, 4.2.1.10: name
// constraints).

#include <cstdint>
#include <string>
#include <vector>

#include "web/web_server.h"

namespace pangea {

// By which browsers may call this machine.
struct MachineNames {
  std::vector<std::string> hosts;      // "robot.local"
  std::vector<std::string> addresses;  // "192.168.1.7", "fd00::7"
};

inline constexpr int kAuthorityDays = 3650;
inline constexpr int kServerDays = 396;  // and one before now; browsers take 398

using Identity = web::TlsIdentity;  // a certificate and its key

// `now_s`: since 1970. `names`: beyond those above.
Identity MakeAuthority(const std::string& name, const MachineNames& names, int64_t now_s);
// Whether certificate and key are of one pair, and the certificate is valid for `days` more.
bool CanVouch(const Identity& authority, int64_t now_s, int days);
// Names that the authority may not vouch for are left out, and returned; the chain has both
// certificates.
struct MadeCertificate {
  Identity identity;
  std::vector<std::string> left_out;
};
MadeCertificate MakeServerCertificate(const Identity& authority, const MachineNames& names,
                                      int64_t now_s);

// Whether browsers that trust the authority take this certificate for all of the names from now_s
// for `days` more. False for what is no certificate.
bool IsGoodFor(const Identity& server, const Identity& authority, const MachineNames& names,
               int64_t now_s, int days);

// SHA-256 of the first certificate in the text, "AB:CD:...". Throws std::runtime_error if there is
// none.
std::string Fingerprint(const std::string& certificate_pem);
// As a file for a phone.
std::string ToDer(const std::string& certificate_pem);

}  // namespace pangea
