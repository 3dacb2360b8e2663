// The program `sextant-full`: every command. `sextant` (main.cc) hands over to it.

#include "sextant/eval/cli/command.h"

int main(int argc, char** argv) { return sextant::program(argc, argv); }
