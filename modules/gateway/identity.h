#pragma once

// The gateway's certificates and address, in the site's folder:
//
//   gateway/ca.pem, ca.key           its authority, made at the first start; ca.key has mode 0600
//   gateway/server.pem, server.key   its certificate; made again if it expires within 30 days, and
//                                    at a start if the machine has another name or address
//   gateway/address.json             its last address: "url", and the authority's "fingerprint"

#include <optional>
#include <string>
#include <vector>

#include "gateway/certificates.h"
#include "site/site.h"

namespace pangea {

struct GatewayIdentity {
  Identity server;
  std::string authority_pem;          // empty: the certificate is the user's own
  std::vector<std::string> left_out;  // names that the authority may not sign
  MachineNames names;                 // all others
  std::string file;                   // of the server's certificate
};

// Reads the certificates and makes those that are missing. Throws std::runtime_error with the file
// and advice.
GatewayIdentity OpenIdentity(const site::Site& site, const MachineNames& names, int64_t now_s);
// Reads the user's own certificate and key from PEM files. Throws std::runtime_error.
GatewayIdentity ReadIdentity(const std::string& certificate_file, const std::string& key_file);

// For a gateway that runs on; call it once a day. Returns a new certificate if the gateway's own
// one expires within 30 days. The user's own one is the user's to renew. Throws std::runtime_error
// with the file, and with the day of a user's certificate that expires so soon.
std::optional<Identity> RenewIdentity(const site::Site& site, const GatewayIdentity& identity,
                                      int64_t now_s);

struct GatewayAddress {
  std::string url;          // "https://192.168.1.7:8443/"
  std::string fingerprint;  // of the authority, or of the user's certificate
};
void WriteAddress(const site::Site& site, const GatewayAddress& address);
// Throws std::runtime_error if the gateway never ran on this site.
GatewayAddress ReadAddress(const site::Site& site);

}  // namespace pangea
