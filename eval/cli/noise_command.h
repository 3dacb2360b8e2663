#pragma once

// `sextant noise`: profiles of real errors.

namespace CLI {
class App;
}

namespace sextant {

void add_noise_command(CLI::App& app);

}  // namespace sextant
