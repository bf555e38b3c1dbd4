// SPDX-License-Identifier: Apache-2.0
// Nothing: targets that precompile headers for others need a source (warmfront_test_headers in ../CMakeLists.txt).
