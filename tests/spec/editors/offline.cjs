// Loaded into the language server first: it must not use the network.
"use strict";
const { Socket } = require("node:net");

Socket.prototype.connect = function () {
  throw new Error("the language server tried to use the network");
};
