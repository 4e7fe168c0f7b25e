-- OpenSim in Neovim (0.7 and later): models and setups highlighted as XML, with osimlite's language server; tables too.
-- Put this file into ~/.config/nvim/plugin/, or run it from your init.lua.
local roots = { "osimlite.toml", "pyproject.toml", ".git" }

local function attach(buffer)
  local found = vim.fs and vim.fs.find(roots, { upward = true, path = vim.fs.dirname(vim.api.nvim_buf_get_name(buffer)) })[1]
  local config = { name = "osimlite", cmd = { "osimlite", "lsp" }, root_dir = found and vim.fs.dirname(found) or vim.fn.getcwd() }
  if vim.lsp.start then
    vim.lsp.start(config, { bufnr = buffer })
  else
    -- Neovim 0.7 starts a server of its own for each file.
    vim.lsp.buf_attach_client(buffer, vim.lsp.start_client(config))
  end
end

vim.api.nvim_create_autocmd({ "BufRead", "BufNewFile" }, {
  pattern = { "*.osim", "*.omoco", "*.xml", "*.sto", "*.mot", "*.trc" },
  callback = function(event)
    local suffix = event.match:match("%.(%a+)$")
    local head = table.concat(vim.api.nvim_buf_get_lines(event.buf, 0, 40, false), "\n")
    if suffix == "xml" and not head:find("<OpenSimDocument") then
      return
    end
    if suffix == "osim" or suffix == "omoco" or suffix == "xml" then
      -- Of the two parts, Neovim takes highlighting, folding and indenting of XML.
      vim.bo[event.buf].filetype = "xml.osim"
    end
    attach(event.buf)
  end,
})
