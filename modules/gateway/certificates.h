#pragma once

// X.509 certificates as PEM texts: the gateway's own authority, and a server certificate that the
// authority signs. Both have P-256 keys.
//
// A phone that trusts the authority trusts whoever has the authority's key. So the authority is
// restricted by name constraints (RFC 5280, 4.2.1.10): to addresses of private networks, to names
// that no public authority signs (.local, .lan, .internal, .home.arpa), and to the names and
// addresses with which it was made.

#include <cstdint>
#include <string>
#include <vector>

#include "web/web_server.h"

namespace pangea {

// The names and addresses by which browsers may reach this machine.
struct MachineNames {
  std::vector<std::string> hosts;      // "robot.local"
  std::vector<std::string> addresses;  // "192.168.1.7", "fd00::7"
};

inline constexpr int kAuthorityDays = 3650;
inline constexpr int kServerDays = 396;  // plus one day before now; browsers accept 398 days

using Identity = web::TlsIdentity;  // a certificate and its key

// Makes an authority. `now_s`: seconds since 1970. `names`: allowed in addition to those above.
Identity MakeAuthority(const std::string& name, const MachineNames& names, int64_t now_s);
// Whether the certificate belongs to the key and is valid for `days` more.
bool CanVouch(const Identity& authority, int64_t now_s, int days);
// Makes a server certificate signed by the authority; the chain has both certificates. Names that
// the authority may not sign are left out, and returned.
struct MadeCertificate {
  Identity identity;
  std::vector<std::string> left_out;
};
MadeCertificate MakeServerCertificate(const Identity& authority, const MachineNames& names,
                                      int64_t now_s);

// Whether browsers that trust the authority accept this certificate for all these names, from now_s
// on for `days` more. False if a text is not a certificate.
bool IsGoodFor(const Identity& server, const Identity& authority, const MachineNames& names,
               int64_t now_s, int days);

// Whether browsers accept the first certificate in the text for this name or address. Throws as
// Fingerprint does.
bool IsFor(const std::string& certificate_pem, const std::string& name);
// SHA-256 of the first certificate in the text, as "AB:CD:...". Throws std::runtime_error if there
// is none.
std::string Fingerprint(const std::string& certificate_pem);
// When the first certificate in the text begins to be valid, and expires, in seconds since 1970.
// Both throw as Fingerprint does.
int64_t BeginOf(const std::string& certificate_pem);
int64_t ExpiryOf(const std::string& certificate_pem);
// The certificate in DER, the file format that phones install.
std::string ToDer(const std::string& certificate_pem);

}  // namespace pangea
